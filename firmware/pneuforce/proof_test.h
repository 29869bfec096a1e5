/* Proof test: a short pulse of each valve, whose effect shows if the tube to the balloon is blocked. The host requests
 * the test and evaluates the pressures.
 * On shutdown: this file drives no pin; the valves that it requests are driven by the sketch only (see board.h). */
#ifndef PROOF_TEST_H
#define PROOF_TEST_H

#include <math.h>

#include "reading.h"
#include "states.h"

/* Sequence of the two valve pulses: first the inlet, then the vent. */
struct proof_test {
    uint16_t elapsed_ms; /* since the start */
    uint16_t vent_ms;    /* duration of the vent pulse */
    float start_kpa;
};

/* Start the test. The vent pulse is as long as necessary to remove the gas of the inlet pulse. It is one sample longer
 * if the pressure is above its band. */
static void proof_test_start(struct proof_test *t, float setpoint_kpa, const struct pressure_reading *r)
{
    float ratio = FILL_KPA_PER_S / (VENT_KPA_PER_S * sqrtf(setpoint_kpa / HALVING_FROM_KPA));
    uint16_t samples = (uint16_t)(TEST_PULSE_MS / SAMPLE_MS * ratio + 0.5f);

    t->elapsed_ms = 0;
    t->start_kpa = r->filtered_kpa;
    t->vent_ms = samples * SAMPLE_MS;
    if (r->filtered_kpa > setpoint_kpa + BAND_KPA)
        t->vent_ms += SAMPLE_MS;
}

/* Add one sample. Without a rise of the pressure, there is no vent pulse: no gas flowed in. */
static void proof_test_step(struct proof_test *t, const struct pressure_reading *r)
{
    elapse(&t->elapsed_ms);
    if (t->elapsed_ms == TEST_HALF_MS && !(r->filtered_kpa - t->start_kpa >= MIN_TEST_RISE_KPA))
        t->vent_ms = 0;
}

/* Return true if both halves are over. */
static bool proof_test_finished(const struct proof_test *t)
{
    return t->elapsed_ms >= 2 * TEST_HALF_MS;
}

/* Return the valves to power. The vent pulse does not depend on the host. */
static uint8_t proof_test_valves(const struct proof_test *t, bool may_open_inlet)
{
    if (t->elapsed_ms < TEST_PULSE_MS)
        return may_open_inlet ? FILL : LOCKED;
    if (t->elapsed_ms >= TEST_HALF_MS && t->elapsed_ms - TEST_HALF_MS < t->vent_ms)
        return SAFE;
    return LOCKED;
}

#endif
