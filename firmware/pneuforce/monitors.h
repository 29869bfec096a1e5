/* Monitors of the open inlet, the open vent, the emptying balloon and the number of top-ups.
 * On shutdown: this file drives no pin; every monitor restarts with the next boot. */
#ifndef MONITORS_H
#define MONITORS_H

#include <math.h>

#include "reading.h"

/* Return the pressure below which the rig counts as empty. */
static float vented_kpa(const struct pressure_reading *r)
{
    return r->zeroed ? VENTED_KPA : VENTED_NOMINAL_KPA;
}

/* Monitor of the pressure since the inlet was opened. */
struct inlet_valve_monitor {
    bool stalled; /* the pressure rose by less than 0.2 kPa in 300 ms */
    uint16_t open_ms;
    uint16_t window_ms;
    float fallen_kpa;     /* fall from the highest pressure since the inlet was opened */
    float rise_kpa_per_s; /* mean rate of the last 0.1 to 0.4 s */
    float window_start_kpa;
    float highest_kpa;
};

/* Add one sample. */
static void inlet_step(struct inlet_valve_monitor *m, bool inlet_open, const struct pressure_reading *r)
{
    if (!inlet_open) {
        memset(m, 0, sizeof *m);
        m->highest_kpa = -INFINITY;
        return;
    }
    if (!m->open_ms)
        m->window_start_kpa = r->filtered_kpa;
    elapse(&m->open_ms);
    elapse(&m->window_ms);
    if (m->window_ms >= LAG_OVER_MS)
        m->rise_kpa_per_s = (r->filtered_kpa - m->window_start_kpa) / (m->window_ms * 1e-3f);
    if (m->window_ms >= RISE_WINDOW_MS) {
        m->stalled = !(r->filtered_kpa - m->window_start_kpa >= MIN_RISE_KPA);
        m->window_start_kpa = r->filtered_kpa;
        m->window_ms = 0;
    }
    if (m->open_ms >= LAG_OVER_MS) {
        m->highest_kpa = fmaxf(m->highest_kpa, r->filtered_kpa);
        m->fallen_kpa = m->highest_kpa - r->filtered_kpa;
    }
}

/* Monitor of the pressure since the vent was opened: detects an empty rig and a vent that stays shut. */
struct vent_valve_monitor {
    bool verified;       /* the pressure shows that the rig is empty */
    uint16_t no_fall_ms; /* time since the pressure last fell by 0.2 kPa, while the rig is not empty */
    uint16_t steady_ms;
    float low_kpa;
    float high_kpa;
    float reference_kpa;
};

static void vent_monitor_restart(struct vent_valve_monitor *m)
{
    m->verified = false;
    m->no_fall_ms = m->steady_ms = 0;
    m->low_kpa = m->reference_kpa = INFINITY;
    m->high_kpa = -INFINITY;
}

/* Count the time at low pressure. Without a zero, the pressure must also be steady. */
static void update_steady_time(struct vent_valve_monitor *m, const struct pressure_reading *r)
{
    float now = r->filtered_kpa;
    float low = fminf(m->low_kpa, now), high = fmaxf(m->high_kpa, now);

    if (now <= vented_kpa(r) && (r->zeroed || high - low <= STEADY_KPA)) {
        m->low_kpa = low;
        m->high_kpa = high;
        elapse(&m->steady_ms);
    } else {
        m->low_kpa = m->high_kpa = now;
        m->steady_ms = 0;
    }
}

/* Add one sample. An invalid sensor or a closed vent restarts the monitor. */
static void vent_monitor_step(struct vent_valve_monitor *m, bool vent_open, const struct pressure_reading *r)
{
    if (!(vent_open && r->sensor_ok)) {
        vent_monitor_restart(m);
        return;
    }
    update_steady_time(m, r);
    m->verified = m->steady_ms >= VENTED_MS;
    if (m->verified || r->filtered_kpa <= m->reference_kpa - MIN_FALL_KPA) {
        m->reference_kpa = r->filtered_kpa;
        m->no_fall_ms = 0;
    } else {
        elapse(&m->no_fall_ms);
    }
}

/* Monitor of the speed at which the vent empties the balloon. The time in which the pressure halves is divided by the
 * time of the commissioned circuit. If only the tubes empty, this ratio is too small, and it is equal for each halving.
 * If a contact ends during the vent, the pressure falls faster, too, but not equally. Therefore, a vent that starts
 * during a contact is judged by three halvings, and every other vent by the first. If the vent valve was already open,
 * as after a trip, the vent is not judged. */
struct emptying_monitor {
    float halving_time_ratio; /* judged halving time / commissioned halving time */
    bool venting;
    bool was_shut;       /* the vent valve was shut before the vent */
    bool pressed;        /* at the start of the vent */
    uint16_t elapsed_ms; /* since the start of the present halving */
    float from_kpa;      /* pressure at that time */
    uint8_t halvings;
    float smallest_ratio;
    float largest_ratio;
};

static void emptying_restart(struct emptying_monitor *m, bool pressed, const struct pressure_reading *r)
{
    m->venting = true;
    m->pressed = pressed;
    m->elapsed_ms = 0;
    m->from_kpa = r->filtered_kpa;
    m->halvings = 0;
    m->smallest_ratio = INFINITY;
    m->largest_ratio = -INFINITY;
}

/* Store the ratio of the halving that has ended. */
static void end_halving(struct emptying_monitor *m, const struct pressure_reading *r)
{
    float delay_ms = m->halvings ? 0.0f : TUBE_LAG_MS + VALVE_DELAY_MS;
    float ratio = ((float)m->elapsed_ms - delay_ms) / (HALVING_TIME_MS * sqrtf(m->from_kpa / HALVING_FROM_KPA));

    m->halvings++;
    m->elapsed_ms = 0;
    m->from_kpa = r->filtered_kpa;
    m->smallest_ratio = fminf(m->smallest_ratio, ratio);
    m->largest_ratio = fmaxf(m->largest_ratio, ratio);
    if (m->halvings == 1 && !m->pressed)
        m->halving_time_ratio = ratio;
    if (m->halvings == HALVINGS && m->pressed && m->smallest_ratio >= EQUAL_RATIO * m->largest_ratio)
        m->halving_time_ratio = m->largest_ratio;
}

/* Add one sample. */
static void emptying_step(struct emptying_monitor *m, bool venting, bool vent_open, bool pressed,
                          const struct pressure_reading *r)
{
    if (!venting) {
        m->halving_time_ratio = INFINITY;
        m->venting = false;
        m->was_shut = !vent_open;
        return;
    }
    if (!m->venting)
        emptying_restart(m, pressed, r);
    elapse(&m->elapsed_ms);
    float lowest_from_kpa = m->halvings ? LATER_HALVING_FROM_KPA : FIRST_HALVING_FROM_KPA;
    bool halved = m->from_kpa >= lowest_from_kpa && r->filtered_kpa <= 0.5f * m->from_kpa;
    if (halved && m->was_shut && m->halvings < HALVINGS)
        end_halving(m, r);
}

/* Monitor of the held pressure: detects when a top-up is due, and counts the top-ups. */
struct top_up_monitor {
    uint16_t low_ms; /* time below the band without contact */
    uint32_t now_ms;
    uint32_t top_ups_ms[TOP_UP_HISTORY]; /* times of the last top-ups, a ring buffer */
    uint8_t count;                       /* top-ups since boot or `restart_top_ups` */
};

/* Add one sample. The pressure is evaluated only if `observed` is true: the balloon is held, without contact, and
 * the host is active. */
static void top_ups_step(struct top_up_monitor *m, bool observed, const struct pressure_reading *r, float setpoint_kpa)
{
    m->now_ms += SAMPLE_MS;
    if (!observed)
        return;
    if (r->filtered_kpa < setpoint_kpa - TOP_UP_BELOW_KPA)
        elapse(&m->low_ms);
    else
        m->low_ms = 0;
}

/* Return true if the balloon needs a top-up. */
static bool top_up_due(const struct top_up_monitor *m)
{
    return m->low_ms >= TOP_UP_AFTER_MS;
}

/* Return the number of top-ups within the last 10 minutes. */
static uint8_t recent_top_up_count(const struct top_up_monitor *m)
{
    uint8_t n, recent = 0, stored = m->count < TOP_UP_HISTORY ? m->count : TOP_UP_HISTORY;

    for (n = 0; n < stored; n++)
        recent += m->now_ms - m->top_ups_ms[n] <= TOP_UP_WINDOW_MS;
    return recent;
}

/* Delete the record of top-ups, because the balloon or a joint may have been repaired. */
static void restart_top_ups(struct top_up_monitor *m)
{
    m->count = 0;
    m->low_ms = 0;
}

/* Record a top-up at the present time. */
static void record_top_up(struct top_up_monitor *m)
{
    m->top_ups_ms[m->count % TOP_UP_HISTORY] = m->now_ms;
    m->count = m->count < UINT8_MAX ? m->count + 1u : UINT8_MAX + 1u - TOP_UP_HISTORY;
    m->low_ms = 0;
}

#endif
