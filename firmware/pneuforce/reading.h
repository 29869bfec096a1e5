/* From ADC sums to a pressure, its smooth course and its rate.
 * On shutdown: nothing here drives a pin; the next boot begins with no reading and no zero. */
#ifndef READING_H
#define READING_H

#include <stdbool.h>
#include <string.h>

#include "elapsed.h"

#define PAST_SAMPLES (PAST_MS / SAMPLE_MS)

/* What the board knows of the pressure. Where the sensor is not alive it keeps its last value. */
struct reading {
    bool alive;
    bool zeroed;
    bool begun;
    uint16_t adc_sum;
    uint16_t unmoved_ms; /* for how long the ADC sum has been the same */
    float pressure_kpa;  /* as sampled, less the zero */
    float smooth_kpa;
    float rate_kpa_per_s;
    float zero_kpa;
    float past_kpa[PAST_SAMPLES]; /* a ring */
    uint8_t past;                 /* how many of them are taken */
    uint8_t oldest;
};

/* Gauge pressure of a sum of 16 conversions, before the zero. Half a count undoes truncation. */
static float nominal_pressure_kpa(uint16_t adc_sum)
{
    const float kpa_per_count = 1.0f / ADC_FULL_SCALE / SENSITIVITY_PER_KPA;

    return (float)(adc_sum + OVERSAMPLING / 2) * kpa_per_count - OFFSET / SENSITIVITY_PER_KPA;
}

/* Pressure 100 ms ago. */
static float before_kpa(const struct reading *r)
{
    return r->past ? r->past_kpa[r->oldest] : r->pressure_kpa;
}

static void remember(struct reading *r)
{
    if (r->past < PAST_SAMPLES) {
        r->past_kpa[r->past++] = r->pressure_kpa;
        return;
    }
    r->past_kpa[r->oldest] = r->pressure_kpa;
    r->oldest = r->oldest + 1u < PAST_SAMPLES ? r->oldest + 1u : 0;
}

static void follow(struct reading *r, float pressure_kpa)
{
    float expected_kpa, surprise_kpa;

    if (!r->past)
        r->smooth_kpa = pressure_kpa;
    r->pressure_kpa = pressure_kpa;
    remember(r);
    expected_kpa = r->smooth_kpa + r->rate_kpa_per_s * SAMPLE_S;
    surprise_kpa = pressure_kpa - expected_kpa;
    r->smooth_kpa = expected_kpa + POSITION_GAIN * surprise_kpa;
    r->rate_kpa_per_s += RATE_GAIN * SAMPLES_PER_S * surprise_kpa;
}

/* One sample later. */
static void reading_step(struct reading *r, uint16_t adc_sum)
{
    if (r->begun && adc_sum == r->adc_sum)
        elapse(&r->unmoved_ms);
    else
        r->unmoved_ms = 0;
    r->begun = true;
    r->adc_sum = adc_sum;
    r->alive = ALIVE_SUM_LEAST <= adc_sum && adc_sum <= ALIVE_SUM_MOST;
    if (r->alive)
        follow(r, nominal_pressure_kpa(adc_sum) - r->zero_kpa);
}

/* Take over the host's zero; one beyond the data sheet's span is none. */
static void set_zero(struct reading *r, float zero_kpa, bool zeroed)
{
    r->zeroed = zeroed && -ZERO_SPAN_KPA <= zero_kpa && zero_kpa <= ZERO_SPAN_KPA;
    if (!r->zeroed)
        zero_kpa = 0.0f;
    if (zero_kpa == r->zero_kpa)
        return;
    r->pressure_kpa += r->zero_kpa - zero_kpa;
    r->smooth_kpa += r->zero_kpa - zero_kpa;
    r->zero_kpa = zero_kpa;
    r->past = r->oldest = 0;
}

#endif
