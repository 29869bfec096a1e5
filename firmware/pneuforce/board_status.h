/* Status of the board at one instant: plain data that the limits evaluate.
 * On shutdown: no value survives; the next boot starts with `board_status_init`. */
#ifndef BOARD_STATUS_H
#define BOARD_STATUS_H

#include "filling.h"
#include "monitors.h"
#include "proof_test.h"
#include "supply.h"

/* State, pressure, valves and the values of the last command. */
struct board_status {
    uint8_t state;
    uint8_t valves;
    bool in_contact;
    uint16_t host_timeout_ms;
    uint16_t since_command_ms; /* time since the last command */
    float setpoint_kpa;        /* setpoint in effect, 0 if there is none */
    float contact_limit_kpa;
    struct pressure_reading reading;
    struct supply_monitor supply;
    struct inlet_valve_monitor inlet;
    struct vent_valve_monitor vent;
    struct emptying_monitor emptying;
    struct fill_controller filling;
    struct top_up_monitor top_ups;
    struct proof_test proof_test;
    uint8_t latched_faults[LIMIT_COUNT]; /* in the order of their occurrence */
    uint8_t latched_fault_count;
};

/* Set the values at boot. */
static void board_status_init(struct board_status *s)
{
    memset(s, 0, sizeof *s);
    s->state = STATE_BOOT;
    s->valves = SAFE;
    s->contact_limit_kpa = CONTACT_LIMIT_AT_BOOT_KPA;
    s->host_timeout_ms = HOST_TIMEOUT_AT_BOOT_MS;
    s->filling.valves = LOCKED;
    s->inlet.highest_kpa = -INFINITY;
    s->emptying.halving_time_ratio = INFINITY;
    vent_monitor_restart(&s->vent);
}

/* Return true if a command was received within the last 250 ms. */
static bool host_active(const struct board_status *s)
{
    return s->since_command_ms <= HOST_SILENCE_MS;
}

/* Return true if the valves may move towards a setpoint: the host is active and the sensor valid. */
static bool may_move_valves(const struct board_status *s)
{
    return host_active(s) && s->reading.sensor_ok;
}

/* Return true if the fault is latched. */
static bool is_latched(const struct board_status *s, uint8_t fault)
{
    uint8_t n;

    for (n = 0; n < s->latched_fault_count; n++)
        if (s->latched_faults[n] == fault)
            return true;
    return false;
}

/* Add one sample to the reading and to all monitors. */
static void board_status_update(struct board_status *s, uint16_t adc_sum, uint16_t supply_mv)
{
    elapse(&s->since_command_ms);
    reading_step(&s->reading, adc_sum);
    supply_step(&s->supply, supply_mv);
    inlet_step(&s->inlet, s->valves == FILL, &s->reading);
    vent_monitor_step(&s->vent, s->valves == SAFE, &s->reading);
    emptying_step(&s->emptying, s->state == STATE_VENTING, s->valves == SAFE, s->in_contact, &s->reading);
    top_ups_step(&s->top_ups, s->state == STATE_HOLDING && may_move_valves(s) && !s->in_contact, &s->reading,
                 s->setpoint_kpa);
}

#endif
