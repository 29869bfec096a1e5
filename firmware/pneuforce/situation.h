/* All that the board knows at one instant: plain data, which the limits judge.
 * On shutdown: nothing of it survives; the next boot begins with `situation_begin`. */
#ifndef SITUATION_H
#define SITUATION_H

#include "filling.h"
#include "supply.h"
#include "watches.h"

/* State, pressure, valves and what the host said last. */
struct situation {
    uint8_t state;
    uint8_t valves;
    bool in_contact;
    uint16_t vent_after_ms;
    uint16_t silent_ms; /* since the last command */
    float setpoint_kpa; /* in effect; 0 where there is none */
    float contact_limit_kpa;
    struct reading reading;
    struct supply supply;
    struct inlet_watch inlet;
    struct vent_watch vent;
    struct emptying_watch emptying;
    struct filling filling;
    struct top_ups top_ups;
    uint8_t latched[LIMIT_COUNT]; /* faults, in the order in which they came */
    uint8_t latched_count;
};

/* As it is at boot. */
static void situation_begin(struct situation *s)
{
    memset(s, 0, sizeof *s);
    s->state = STATE_BOOT;
    s->valves = SAFE;
    s->contact_limit_kpa = CONTACT_LIMIT_AT_BOOT_KPA;
    s->vent_after_ms = VENT_AFTER_AT_BOOT_MS;
    s->filling.valves = LOCKED;
    s->inlet.highest_kpa = -INFINITY;
    s->emptying.halved_share = INFINITY;
    vent_restart(&s->vent);
}

/* Whether the host has spoken lately. */
static bool host_heard(const struct situation *s)
{
    return s->silent_ms <= HOST_SILENCE_MS;
}

/* Whether a valve may be moved towards a setpoint: with a host and a sensor only. */
static bool may_move(const struct situation *s)
{
    return host_heard(s) && s->reading.alive;
}

/* Whether a fault is latched. */
static bool is_latched(const struct situation *s, uint8_t fault)
{
    uint8_t n;

    for (n = 0; n < s->latched_count; n++)
        if (s->latched[n] == fault)
            return true;
    return false;
}

/* One sample later. */
static void observe(struct situation *s, uint16_t adc_sum, uint16_t supply_mv)
{
    elapse(&s->silent_ms);
    reading_step(&s->reading, adc_sum);
    supply_step(&s->supply, supply_mv);
    inlet_step(&s->inlet, s->valves == FILL, &s->reading);
    vent_step(&s->vent, s->valves == SAFE, &s->reading);
    emptying_step(&s->emptying, s->state == STATE_VENTING, s->in_contact, &s->reading);
    top_ups_step(&s->top_ups, s->state == STATE_HOLDING && may_move(s) && !s->in_contact, &s->reading,
                 s->setpoint_kpa);
}

#endif
