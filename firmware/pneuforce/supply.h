/* The supply as a mean: one conversion of the bandgap knows it to a step of 22 mV only.
 * On shutdown: nothing here drives a pin; the next boot begins without a mean. */
#ifndef SUPPLY_H
#define SUPPLY_H

#include "numbers.h"

/* What supplies sensor, ADC and relays. */
struct supply {
    uint16_t mean_mv;                 /* of the last 16 samples, or as many as there were */
    uint16_t past_mv[SUPPLY_SAMPLES]; /* a ring */
    uint32_t sum_mv;
    uint8_t past; /* how many of them are taken */
    uint8_t oldest;
};

/* One sample later. */
static void supply_step(struct supply *s, uint16_t supply_mv)
{
    if (s->past < SUPPLY_SAMPLES)
        s->past++;
    s->sum_mv += supply_mv;
    s->sum_mv -= s->past_mv[s->oldest];
    s->past_mv[s->oldest] = supply_mv;
    s->oldest = (s->oldest + 1u) % SUPPLY_SAMPLES;
    s->mean_mv = (uint16_t)(s->sum_mv / s->past);
}

#endif
