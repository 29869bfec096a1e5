/* Moving average of the supply voltage. A single conversion of the bandgap resolves only 22 mV.
 * On shutdown: this file drives no pin; the next boot starts without an average. */
#ifndef SUPPLY_H
#define SUPPLY_H

#include "numbers.h"

/* Mean supply voltage of sensor, ADC and relays. */
struct supply_monitor {
    uint16_t mean_mv;                    /* mean of the last 16 samples, or of all samples if there are fewer */
    uint16_t history_mv[SUPPLY_SAMPLES]; /* ring buffer */
    uint32_t sum_mv;
    uint8_t history_count; /* samples in the ring buffer */
    uint8_t oldest;
};

/* Add one sample. */
static void supply_step(struct supply_monitor *s, uint16_t supply_mv)
{
    if (s->history_count < SUPPLY_SAMPLES)
        s->history_count++;
    s->sum_mv += supply_mv;
    s->sum_mv -= s->history_mv[s->oldest];
    s->history_mv[s->oldest] = supply_mv;
    s->oldest = (s->oldest + 1u) % SUPPLY_SAMPLES;
    s->mean_mv = (uint16_t)(s->sum_mv / s->history_count);
}

#endif
