/* Limits of the board: conditions that must be true in certain states. A violated condition trips the board. A NaN
 * violates every condition.
 * On shutdown: this file drives no pin; a board without power is SAFE and violates no limit. */
#ifndef LIMITS_H
#define LIMITS_H

#include "board_status.h"

/* Condition that must be true in `states`. `samples` violations in a row latch `fault`. */
struct limit {
    uint8_t fault;
    uint8_t states;
    uint8_t samples;
    bool (*condition)(const struct board_status *);
};

/* Condition under which a latched fault may be cleared. */
struct clear_condition {
    uint8_t fault;
    bool (*condition)(const struct board_status *);
};

/* Return true if the sensor is neither open nor short. */
static bool sensor_ok(const struct board_status *s)
{
    return s->reading.sensor_ok;
}

/* Return true if the mean supply voltage of sensor and valves is within 4.75-5.25 V. */
static bool supply_ok(const struct board_status *s)
{
    return MIN_SUPPLY_MV <= s->supply.mean_mv && s->supply.mean_mv <= MAX_SUPPLY_MV;
}

/* Return true if the pressure is within the hard limit, which no host can raise. */
static bool below_hard_limit(const struct board_status *s)
{
    return s->reading.pressure_kpa <= HARD_LIMIT_KPA;
}

/* Return true if the pressure is at most 0.5 kPa above the setpoint and at most 12.5 kPa. On the way down to a lower
 * setpoint, the limit falls with the pressure. */
static bool below_filling_limit(const struct board_status *s)
{
    float highest_kpa = fmaxf(s->setpoint_kpa, s->filling.lowest_kpa) + OVERSHOOT_KPA;

    return s->reading.pressure_kpa <= fminf(highest_kpa, FILLING_LIMIT_KPA);
}

/* Return true if the pressure of the held balloon is within the contact limit of the host. */
static bool below_contact_limit(const struct board_status *s)
{
    return s->reading.pressure_kpa <= s->contact_limit_kpa;
}

/* Return false if the pressure fell by more than half in 100 ms. A fall to a pressure near the setpoint is allowed,
 * because it is the end of a contact. */
static bool balloon_intact(const struct board_status *s)
{
    float now_kpa = s->reading.pressure_kpa;

    return now_kpa >= 0.5f * past_kpa(&s->reading) || now_kpa >= s->setpoint_kpa - BURST_BELOW_KPA;
}

/* Return false if the pressure falls although the inlet is open. It falls if the balloon is past its limit point. */
static bool not_past_limit_point(const struct board_status *s)
{
    return s->inlet.fallen_kpa <= LIMIT_POINT_KPA;
}

/* Return false if the ADC sum does not change although an open valve must change the pressure. */
static bool sensor_moves(const struct board_status *s)
{
    bool emptying = s->valves == SAFE && s->reading.pressure_kpa > vented_kpa(&s->reading);

    return !(emptying || s->valves == FILL) || s->reading.unchanged_ms < FROZEN_MS;
}

/* Return false if the pressure does not rise although the inlet is open. */
static bool pressure_rises(const struct board_status *s)
{
    return !s->inlet.stalled;
}

/* Return true if the pressure of the vented rig stays low. */
static bool stays_vented(const struct board_status *s)
{
    return s->reading.pressure_kpa <= vented_kpa(&s->reading) + INLET_LEAK_KPA;
}

/* Return false if the pressure does not fall although the vent is open and the rig is not empty. */
static bool pressure_falls(const struct board_status *s)
{
    return s->vent.no_fall_ms <= VENT_SHUT_MS;
}

/* Return true if the pressure rises no faster than the filling of tubes and balloon allows. If the tube is occluded,
 * the gas fills the tubes alone, and the pressure rises faster. */
static bool fill_rate_plausible(const struct board_status *s)
{
    return s->inlet.rise_kpa_per_s <= FILL_KPA_PER_S / OCCLUDED_TIME_RATIO;
}

/* Return true if the pressure falls no faster than the emptying of tubes and balloon allows. If the tube is
 * occluded, the vent empties the tubes alone, and the pressure falls faster. */
static bool vent_rate_plausible(const struct board_status *s)
{
    return s->emptying.halving_time_ratio >= OCCLUDED_TIME_RATIO;
}

/* Return false if a top-up is due but the largest allowed number of top-ups in ten minutes has been reached. */
static bool few_top_ups(const struct board_status *s)
{
    return !top_up_due(&s->top_ups) || recent_top_up_count(&s->top_ups) < MAX_TOP_UPS;
}

/* Return true if the time and the valve actions since the new setpoint are within their limits. */
static bool setpoint_in_time(const struct board_status *s)
{
    return s->filling.elapsed_ms <= SETPOINT_TIMEOUT_MS && s->filling.valve_actions <= MAX_VALVE_ACTIONS;
}

/* Return true if the last command is not older than the timeout that the host requested. */
static bool host_in_time(const struct board_status *s)
{
    return s->since_command_ms <= s->host_timeout_ms;
}

/* Return true if the pressure is within the limit for an inflation. */
static bool overpressure_gone(const struct board_status *s)
{
    return s->reading.pressure_kpa <= FILLING_LIMIT_KPA;
}

/* Return true if the pressure shows that the rig is empty. */
static bool vent_verified(const struct board_status *s)
{
    return s->vent.verified;
}

/* Return true if the host is active again. */
static bool host_reconnected(const struct board_status *s)
{
    return host_active(s);
}

#define LIMIT(fault, states, samples, condition) {fault, states, samples, condition},
static const struct limit LIMITS[LIMIT_COUNT] = {LIMIT_ROWS(LIMIT)};
#undef LIMIT

/* A fault that is not listed here can always be cleared, because its cause cannot be detected while the rig is SAFE. */
#define CLEAR_CONDITION(fault, condition) {fault, condition},
static const struct clear_condition CLEAR_CONDITIONS[] = {CLEAR_CONDITION_ROWS(CLEAR_CONDITION)};
#undef CLEAR_CONDITION

/* Return true if the cause of a latched fault is gone. */
static bool cause_gone(const struct board_status *s, uint8_t fault)
{
    uint8_t n;

    for (n = 0; n < sizeof CLEAR_CONDITIONS / sizeof CLEAR_CONDITIONS[0]; n++)
        if (CLEAR_CONDITIONS[n].fault == fault)
            return CLEAR_CONDITIONS[n].condition(s);
    return true;
}

#endif
