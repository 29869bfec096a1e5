/* Inflating and settling: control of the valves until the balloon reaches the setpoint.
 * On shutdown: this file drives no pin; the valves that it requests are driven by the sketch only (see board.h). */
#ifndef FILLING_H
#define FILLING_H

#include <math.h>

#include "reading.h"
#include "states.h"

/* Controller of the valves from one setpoint to the next. */
struct fill_controller {
    uint8_t valves;
    uint8_t valve_actions;    /* since the start */
    uint16_t elapsed_ms;      /* since the start */
    uint16_t since_action_ms; /* time since the last valve action */
    uint16_t in_band_ms;
    uint16_t pulse_left_ms; /* remaining time of the pulse in progress */
    float lowest_kpa;       /* lowest pressure since the start */
};

/* Return the pressure that the sensor will show after both valves are closed now. */
static float predicted_kpa(const struct pressure_reading *r)
{
    return r->filtered_kpa + r->rate_kpa_per_s * ((TUBE_LAG_MS + VALVE_DELAY_MS) * 1e-3f);
}

/* Start filling to a new setpoint from the present pressure. */
static void filling_start(struct fill_controller *f, const struct pressure_reading *r)
{
    f->elapsed_ms = f->in_band_ms = 0;
    f->valve_actions = 0;
    f->lowest_kpa = predicted_kpa(r);
}

static void filling_drive(struct fill_controller *f, uint8_t valves)
{
    if (valves == f->valves)
        return;
    f->valves = valves;
    f->since_action_ms = 0;
    if (f->valve_actions < UINT8_MAX)
        f->valve_actions++;
}

/* Close both valves immediately. */
static void filling_lock(struct fill_controller *f)
{
    filling_drive(f, LOCKED);
    f->pulse_left_ms = 0;
}

/* Update times and the lowest pressure by one sample. */
static void filling_step(struct fill_controller *f, const struct pressure_reading *r)
{
    elapse(&f->elapsed_ms);
    elapse(&f->since_action_ms);
    f->pulse_left_ms = f->pulse_left_ms > SAMPLE_MS ? f->pulse_left_ms - SAMPLE_MS : 0;
    if (r->filtered_kpa < f->lowest_kpa)
        f->lowest_kpa = r->filtered_kpa;
}

/* Keep the inlet open until the predicted pressure is near the setpoint. The pressure still rises afterwards, because
 * the valve and the tube cause a delay. */
static uint8_t inflate(struct fill_controller *f, const struct pressure_reading *r, float setpoint_kpa)
{
    if (predicted_kpa(r) < setpoint_kpa - BAND_KPA) {
        filling_drive(f, FILL);
        return NO_TRIGGER;
    }
    filling_lock(f);
    return TRIGGER_NEAR_SETPOINT;
}

static void start_pulse(struct fill_controller *f, float error_kpa)
{
    float rate = error_kpa > 0 ? FILL_KPA_PER_S : -VENT_KPA_PER_S;
    float requested_ms = ceilf(PULSE_FRACTION * 1e3f * error_kpa / rate);

    f->pulse_left_ms = requested_ms <= MAX_PULSE_MS ? (uint16_t)requested_ms : MAX_PULSE_MS;
    filling_drive(f, error_kpa > 0 ? FILL : SAFE);
}

/* Wait until tube and balloon have the same pressure. Then open a valve in pulses until the pressure stays within
 * the band around the setpoint. */
static uint8_t settle(struct fill_controller *f, const struct pressure_reading *r, float setpoint_kpa)
{
    float error_kpa = setpoint_kpa - r->filtered_kpa;

    if (f->pulse_left_ms)
        return NO_TRIGGER;
    filling_drive(f, LOCKED);
    if (f->since_action_ms < EQUALISE_MS)
        return NO_TRIGGER;
    if (-BAND_KPA <= error_kpa && error_kpa <= BAND_KPA) {
        elapse(&f->in_band_ms);
        return f->in_band_ms >= IN_BAND_MS ? TRIGGER_SETTLED : NO_TRIGGER;
    }
    f->in_band_ms = 0;
    if (error_kpa > FAR_KPA)
        return TRIGGER_FAR_BELOW_SETPOINT;
    start_pulse(f, error_kpa);
    return NO_TRIGGER;
}

#endif
