/* What must be watched over time: the open inlet, the open vent, and how often the board tops up.
 * On shutdown: nothing here drives a pin; every watch begins anew with the next boot. */
#ifndef WATCHES_H
#define WATCHES_H

#include <math.h>

#include "reading.h"

/* Pressure below which the rig counts as empty. */
static float vented_kpa(const struct reading *r)
{
    return r->zeroed ? VENTED_KPA : VENTED_NOMINAL_KPA;
}

/* The pressure since the inlet was opened. */
struct inlet_watch {
    bool stalled;         /* no rise of 0.2 kPa in 300 ms */
    uint16_t open_ms;
    uint16_t window_ms;
    float fallen_kpa;     /* below the highest pressure since */
    float rise_kpa_per_s; /* mean of the last 0.1 to 0.4 s */
    float from_kpa;
    float highest_kpa;
};

/* One sample later. */
static void inlet_step(struct inlet_watch *w, bool inlet_open, const struct reading *r)
{
    if (!inlet_open) {
        memset(w, 0, sizeof *w);
        w->highest_kpa = -INFINITY;
        return;
    }
    if (!w->open_ms)
        w->from_kpa = r->smooth_kpa;
    elapse(&w->open_ms);
    elapse(&w->window_ms);
    if (w->window_ms >= LAG_OVER_MS)
        w->rise_kpa_per_s = (r->smooth_kpa - w->from_kpa) / (w->window_ms * 1e-3f);
    if (w->window_ms >= RISE_WITHIN_MS) {
        w->stalled = !(r->smooth_kpa - w->from_kpa >= RISE_KPA);
        w->from_kpa = r->smooth_kpa;
        w->window_ms = 0;
    }
    if (w->open_ms >= LAG_OVER_MS) {
        w->highest_kpa = fmaxf(w->highest_kpa, r->smooth_kpa);
        w->fallen_kpa = w->highest_kpa - r->smooth_kpa;
    }
}

/* The pressure since the vent was opened: whether the rig is empty, or fails to become so. */
struct vent_watch {
    bool verified;
    uint16_t unmoved_ms; /* since the pressure last fell by 0.2 kPa, while the rig is not empty */
    uint16_t steady_ms;
    float low_kpa;
    float high_kpa;
    float mark_kpa;
};

static void vent_restart(struct vent_watch *w)
{
    w->verified = false;
    w->unmoved_ms = w->steady_ms = 0;
    w->low_kpa = w->mark_kpa = INFINITY;
    w->high_kpa = -INFINITY;
}

/* With a zero, low is enough; without one the pressure must also be steady. */
static void vent_steady(struct vent_watch *w, const struct reading *r)
{
    float now = r->smooth_kpa;
    float low = fminf(w->low_kpa, now), high = fmaxf(w->high_kpa, now);

    if (now <= vented_kpa(r) && (r->zeroed || high - low <= STEADY_KPA)) {
        w->low_kpa = low;
        w->high_kpa = high;
        elapse(&w->steady_ms);
    } else {
        w->low_kpa = w->high_kpa = now;
        w->steady_ms = 0;
    }
}

/* One sample later. A sensor that is not alive tells nothing. */
static void vent_step(struct vent_watch *w, bool vent_open, const struct reading *r)
{
    if (!(vent_open && r->alive)) {
        vent_restart(w);
        return;
    }
    vent_steady(w, r);
    w->verified = w->steady_ms >= VENTED_MS;
    if (w->verified || r->smooth_kpa <= w->mark_kpa - FALL_KPA) {
        w->mark_kpa = r->smooth_kpa;
        w->unmoved_ms = 0;
    } else {
        elapse(&w->unmoved_ms);
    }
}

/* How fast the vent empties the balloon. A pressed one empties faster, and tells nothing. */
struct emptying_watch {
    uint16_t open_ms;
    float halved_share; /* time in which the pressure was halved, as share of the commissioned one */
    float from_kpa;
};

/* One sample later. */
static void emptying_step(struct emptying_watch *w, bool venting, bool pressed, const struct reading *r)
{
    if (!venting) {
        w->halved_share = INFINITY;
        w->open_ms = 0;
        return;
    }
    if (!w->open_ms)
        w->from_kpa = pressed ? 0.0f : r->smooth_kpa;
    elapse(&w->open_ms);
    if (w->from_kpa >= HALVED_FROM_KPA && r->smooth_kpa <= 0.5f * w->from_kpa && isinf(w->halved_share)) {
        float commissioned_ms = HALVING_MS * sqrtf(w->from_kpa / HALVED_KPA);
        w->halved_share = ((float)w->open_ms - (TUBE_MS + VALVE_MS)) / commissioned_ms;
    }
}

/* Whether the held pressure has leaked out of its band, and how often that was mended. */
struct top_ups {
    uint16_t low_ms;                  /* time without contact below the band */
    uint32_t now_ms;
    uint32_t mended_ms[TOP_UPS_KEPT]; /* a ring */
    uint8_t mended;                   /* how often, ever */
};

/* One sample later. `free`: held, heard and without contact; else nothing is learned. */
static void top_ups_step(struct top_ups *t, bool free, const struct reading *r, float setpoint_kpa)
{
    t->now_ms += SAMPLE_MS;
    if (!free)
        return;
    if (r->smooth_kpa < setpoint_kpa - LOW_KPA)
        elapse(&t->low_ms);
    else
        t->low_ms = 0;
}

/* Whether the balloon wants gas. */
static bool top_up_due(const struct top_ups *t)
{
    return t->low_ms >= LOW_MS;
}

/* Top-ups within the last 10 minutes. */
static uint8_t recent_top_ups(const struct top_ups *t)
{
    uint8_t n, recent = 0, kept = t->mended < TOP_UPS_KEPT ? t->mended : TOP_UPS_KEPT;

    for (n = 0; n < kept; n++)
        recent += t->now_ms - t->mended_ms[n] <= TOP_UPS_WITHIN_MS;
    return recent;
}

/* Note that one is done now. */
static void mend(struct top_ups *t)
{
    t->mended_ms[t->mended % TOP_UPS_KEPT] = t->now_ms;
    t->mended = t->mended < UINT8_MAX ? t->mended + 1u : UINT8_MAX + 1u - TOP_UPS_KEPT;
    t->low_ms = 0;
}

#endif
