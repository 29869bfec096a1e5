/* Conversion of ADC sums to a pressure, a filtered pressure and a rate of change.
 * On shutdown: this file drives no pin; the next boot starts with no reading and no zero. */
#ifndef READING_H
#define READING_H

#include <stdbool.h>
#include <string.h>

#include "elapsed.h"

#define HISTORY_SAMPLES (HISTORY_MS / SAMPLE_MS)

/* Pressure as the board measures it. While the sensor is invalid, the last valid values remain. */
struct pressure_reading {
    bool sensor_ok;  /* the sensor is neither open nor short */
    bool zeroed;     /* zero_kpa is a valid zero from the host */
    bool has_sample; /* false before the first sample */
    uint16_t adc_sum;
    uint16_t unchanged_ms; /* time for which the ADC sum has been the same */
    float pressure_kpa;    /* last sample minus the zero */
    float filtered_kpa;
    float rate_kpa_per_s;
    float zero_kpa;
    float history_kpa[HISTORY_SAMPLES]; /* ring buffer */
    uint8_t history_count;              /* samples in the ring buffer */
    uint8_t oldest;
};

/* Return the gauge pressure of a sum of 16 conversions, without zero correction. Half a count is added to each
 * conversion because the converter truncates. */
static float nominal_pressure_kpa(uint16_t adc_sum)
{
    const float kpa_per_count = 1.0f / ADC_FULL_SCALE / SENSITIVITY_PER_KPA;

    return (float)(adc_sum + OVERSAMPLING / 2) * kpa_per_count - OFFSET / SENSITIVITY_PER_KPA;
}

/* Return the pressure 100 ms ago. */
static float past_kpa(const struct pressure_reading *r)
{
    return r->history_count ? r->history_kpa[r->oldest] : r->pressure_kpa;
}

static void add_to_history(struct pressure_reading *r)
{
    if (r->history_count < HISTORY_SAMPLES) {
        r->history_kpa[r->history_count++] = r->pressure_kpa;
        return;
    }
    r->history_kpa[r->oldest] = r->pressure_kpa;
    r->oldest = r->oldest + 1u < HISTORY_SAMPLES ? r->oldest + 1u : 0;
}

static void update_filter(struct pressure_reading *r, float pressure_kpa)
{
    float predicted_kpa, residual_kpa;

    if (!r->history_count)
        r->filtered_kpa = pressure_kpa;
    r->pressure_kpa = pressure_kpa;
    add_to_history(r);
    predicted_kpa = r->filtered_kpa + r->rate_kpa_per_s * SAMPLE_S;
    residual_kpa = pressure_kpa - predicted_kpa;
    r->filtered_kpa = predicted_kpa + POSITION_GAIN * residual_kpa;
    r->rate_kpa_per_s += RATE_GAIN * SAMPLES_PER_S * residual_kpa;
}

/* Add one sample. */
static void reading_step(struct pressure_reading *r, uint16_t adc_sum)
{
    if (r->has_sample && adc_sum == r->adc_sum)
        elapse(&r->unchanged_ms);
    else
        r->unchanged_ms = 0;
    r->has_sample = true;
    r->adc_sum = adc_sum;
    r->sensor_ok = MIN_VALID_ADC_SUM <= adc_sum && adc_sum <= MAX_VALID_ADC_SUM;
    if (r->sensor_ok)
        update_filter(r, nominal_pressure_kpa(adc_sum) - r->zero_kpa);
}

/* Apply the zero of the host. A zero beyond the span of the data sheet is invalid and counts as missing. */
static void set_zero(struct pressure_reading *r, float zero_kpa, bool zeroed)
{
    r->zeroed = zeroed && -ZERO_SPAN_KPA <= zero_kpa && zero_kpa <= ZERO_SPAN_KPA;
    if (!r->zeroed)
        zero_kpa = 0.0f;
    if (zero_kpa == r->zero_kpa)
        return;
    r->pressure_kpa += r->zero_kpa - zero_kpa;
    r->filtered_kpa += r->zero_kpa - zero_kpa;
    r->zero_kpa = zero_kpa;
    r->history_count = r->oldest = 0;
}

#endif
