/* Inflating and settling: how the valves bring the balloon to its setpoint.
 * On shutdown: what is wanted of the valves here reaches no pin by itself (see board.h). */
#ifndef FILLING_H
#define FILLING_H

#include <math.h>

#include "reading.h"
#include "states.h"

/* One journey to a setpoint. */
struct filling {
    uint8_t valves;
    uint8_t actions; /* of valves since the journey began */
    uint16_t elapsed_ms;
    uint16_t still_ms; /* since the last valve action */
    uint16_t within_ms;
    uint16_t pulse_ms; /* left of the pulse in progress */
    float lowest_kpa;  /* since the journey began */
};

/* Pressure at the sensor once the tube has equalised, were a valve told to close now. */
static float coming_kpa(const struct reading *r)
{
    return r->smooth_kpa + r->rate_kpa_per_s * ((TUBE_MS + VALVE_MS) * 1e-3f);
}

/* Set out to a new setpoint from where the pressure is now. */
static void filling_begin(struct filling *f, const struct reading *r)
{
    f->elapsed_ms = f->within_ms = 0;
    f->actions = 0;
    f->lowest_kpa = coming_kpa(r);
}

static void filling_drive(struct filling *f, uint8_t valves)
{
    if (valves == f->valves)
        return;
    f->valves = valves;
    f->still_ms = 0;
    if (f->actions < UINT8_MAX)
        f->actions++;
}

/* Shut both valves at once. */
static void filling_lock(struct filling *f)
{
    filling_drive(f, LOCKED);
    f->pulse_ms = 0;
}

/* Time passes, whatever the valves do. */
static void filling_step(struct filling *f, const struct reading *r)
{
    elapse(&f->elapsed_ms);
    elapse(&f->still_ms);
    f->pulse_ms = f->pulse_ms > SAMPLE_MS ? f->pulse_ms - SAMPLE_MS : 0;
    if (r->smooth_kpa < f->lowest_kpa)
        f->lowest_kpa = r->smooth_kpa;
}

/* Keep the inlet open until what is still coming through the tube is enough. */
static uint8_t inflate(struct filling *f, const struct reading *r, float setpoint_kpa)
{
    if (coming_kpa(r) < setpoint_kpa - BAND_KPA) {
        filling_drive(f, FILL);
        return NOTHING_HAPPENS;
    }
    filling_lock(f);
    return HAPPENS_NEAR;
}

static void pulse(struct filling *f, float error_kpa)
{
    float rate = error_kpa > 0 ? FILL_KPA_PER_S : -VENT_KPA_PER_S;
    float wanted_ms = ceilf(PULSE_SHARE * 1e3f * error_kpa / rate);

    f->pulse_ms = wanted_ms <= LONGEST_PULSE_MS ? (uint16_t)wanted_ms : LONGEST_PULSE_MS;
    filling_drive(f, error_kpa > 0 ? FILL : SAFE);
}

/* Wait for equal pressures, then pulse towards the setpoint until it is held for a while. */
static uint8_t settle(struct filling *f, const struct reading *r, float setpoint_kpa)
{
    float error_kpa = setpoint_kpa - r->smooth_kpa;

    if (f->pulse_ms)
        return NOTHING_HAPPENS;
    filling_drive(f, LOCKED);
    if (f->still_ms < EQUAL_MS)
        return NOTHING_HAPPENS;
    if (-BAND_KPA <= error_kpa && error_kpa <= BAND_KPA) {
        elapse(&f->within_ms);
        return f->within_ms >= WITHIN_MS ? HAPPENS_SETTLED : NOTHING_HAPPENS;
    }
    f->within_ms = 0;
    if (error_kpa > FAR_KPA)
        return HAPPENS_FAR;
    pulse(f, error_kpa);
    return NOTHING_HAPPENS;
}

#endif
