/* The limits: what is allowed in which state. What is not allowed trips the board. NaN is never allowed.
 * On shutdown: nothing here drives a pin; a board without current is SAFE, which breaks no limit. */
#ifndef LIMITS_H
#define LIMITS_H

#include "situation.h"

/* What must hold in `states`; broken on `samples` in a row, `fault` is latched. */
struct limit {
    uint8_t fault;
    uint8_t states;
    uint8_t samples;
    bool (*allowed)(const struct situation *);
};

/* A latched fault may be cleared once this holds. */
struct gone {
    uint8_t fault;
    bool (*allowed)(const struct situation *);
};

/* The sensor is neither open nor short. */
static bool alive(const struct situation *s)
{
    return s->reading.alive;
}

/* The mean supply of sensor and valves is in its span. */
static bool supplied(const struct situation *s)
{
    return SUPPLY_MV_LEAST <= s->supply.mean_mv && s->supply.mean_mv <= SUPPLY_MV_MOST;
}

/* No host can raise this one. */
static bool below_hard_limit(const struct situation *s)
{
    return s->reading.pressure_kpa <= HARD_LIMIT_KPA;
}

/* On the way down to a lower setpoint the limit comes down with the pressure. */
static bool below_filling_limit(const struct situation *s)
{
    float highest_kpa = fmaxf(s->setpoint_kpa, s->filling.lowest_kpa) + OVERSHOOT_KPA;

    return s->reading.pressure_kpa <= fminf(highest_kpa, FILLING_LIMIT_KPA);
}

/* The locked balloon is pressed no harder than the host allows. */
static bool below_contact_limit(const struct situation *s)
{
    return s->reading.pressure_kpa <= s->contact_limit_kpa;
}

/* The locked pressure did not fall by half in 100 ms, or only back from a contact. */
static bool intact(const struct situation *s)
{
    float now_kpa = s->reading.pressure_kpa;

    return now_kpa >= 0.5f * before_kpa(&s->reading) || now_kpa >= s->setpoint_kpa - BURST_BELOW_KPA;
}

/* With the inlet open the pressure does not fall: past the limit point it would. */
static bool keeps_rising(const struct situation *s)
{
    return s->inlet.fallen_kpa <= LIMIT_POINT_KPA;
}

/* The ADC sum moves while a valve is open and the pressure must. */
static bool moving(const struct situation *s)
{
    bool emptying = s->valves == SAFE && s->reading.pressure_kpa > vented_kpa(&s->reading);

    return !(emptying || s->valves == FILL) || s->reading.unmoved_ms < STUCK_MS;
}

/* The open inlet brings gas. */
static bool rises(const struct situation *s)
{
    return !s->inlet.stalled;
}

/* A vented rig stays vented. */
static bool inlet_shut(const struct situation *s)
{
    return s->reading.pressure_kpa <= vented_kpa(&s->reading) + INLET_LEAK_KPA;
}

/* With the vent open the pressure falls until the rig is empty. */
static bool empties(const struct situation *s)
{
    return s->vent.unmoved_ms <= VENT_SHUT_MS;
}

/* The pressure rises as fast as where tubes and balloon are filled, not the tubes alone. */
static bool fills_slowly(const struct situation *s)
{
    return s->inlet.rise_kpa_per_s <= FILL_KPA_PER_S / OCCLUDED_SHARE;
}

/* The pressure falls as fast as where tubes and balloon are emptied, not the tubes alone. */
static bool empties_slowly(const struct situation *s)
{
    return s->emptying.halved_share >= OCCLUDED_SHARE;
}

/* What leaks out of the band is topped up a few times only. */
static bool keeps_gas(const struct situation *s)
{
    return !top_up_due(&s->top_ups) || recent_top_ups(&s->top_ups) < MOST_TOP_UPS;
}

/* The setpoint is reached in time and without endless clicking. */
static bool in_time(const struct situation *s)
{
    return s->filling.elapsed_ms <= TIMEOUT_MS && s->filling.actions <= MOST_ACTIONS;
}

/* The host was heard within the time that it asked for itself. */
static bool host_speaks(const struct situation *s)
{
    return s->silent_ms <= s->vent_after_ms;
}

/* The pressure is one that an inflation may have. */
static bool overpressure_gone(const struct situation *s)
{
    return s->reading.pressure_kpa <= FILLING_LIMIT_KPA;
}

/* The rig is vented, and verified so. */
static bool empty(const struct situation *s)
{
    return s->vent.verified;
}

/* The host has spoken lately. */
static bool heard(const struct situation *s)
{
    return host_heard(s);
}

#define LIMIT(fault, states, samples, allowed) {fault, states, samples, allowed},
static const struct limit LIMITS[LIMIT_COUNT] = {LIMIT_ROWS(LIMIT)};
#undef LIMIT

/* What is not named here cannot be seen any more once the rig is SAFE. */
#define GONE_WHEN(fault, allowed) {fault, allowed},
static const struct gone GONE[] = {GONE_ROWS(GONE_WHEN)};
#undef GONE_WHEN

/* Whether the cause of a latched fault is gone. */
static bool cause_gone(const struct situation *s, uint8_t fault)
{
    uint8_t n;

    for (n = 0; n < sizeof GONE / sizeof GONE[0]; n++)
        if (GONE[n].fault == fault)
            return GONE[n].allowed(s);
    return true;
}

#endif
