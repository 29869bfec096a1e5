/* Pressure control: executes the state machine and the limits sample by sample.
 * On shutdown: the next boot starts disarmed and SAFE; the board inflates only after VENT and then HOLD. */
#ifndef PRESSURE_CONTROL_H
#define PRESSURE_CONTROL_H

#include "limits.h"

#define MAX_CHANGES 8u
#define NO_VALUE (-1)
/* The code divides by 1000 and does not multiply by 0.001, so that decimal limits in Pa stay exact. */
#define PA_PER_KPA 1000.0f

/* Change that is reported to the host: a state that was entered, or a fault that was latched. */
struct state_change {
    uint8_t state;
    uint8_t previous_state;
    uint8_t fault;
};

/* Controller that applies commands, enforces the limits and drives the valves. */
struct pressure_controller {
    struct board_status status;
    struct state_change changes[MAX_CHANGES]; /* not yet reported to the host */
    uint8_t change_count;
    /* VENT was applied after the last boot, trip, Identify and Vent message. A silent host also disarms a
     * rig that is not pressurised. */
    bool armed;
    int16_t last_clear;  /* last `clear` value; the first value after Identify is the reference */
    int16_t last_test;   /* last `proof_test` value, with the same reference */
    bool test_requested; /* for the next sample only */
    float requested_kpa; /* 0: no setpoint is requested */
    uint8_t violations[LIMIT_COUNT];
};

static void record_change(struct pressure_controller *p, uint8_t previous_state, uint8_t fault)
{
    struct state_change change = {p->status.state, previous_state, fault};

    if (p->change_count < MAX_CHANGES)
        p->changes[p->change_count++] = change;
}

/* Change the state by the transition table. Return false if the state does not list the trigger. */
static bool apply_trigger(struct pressure_controller *p, uint8_t trigger, uint8_t fault)
{
    uint8_t previous_state = p->status.state, state = TRANSITIONS[previous_state][trigger], n;

    if (state == STAYS)
        return false;
    p->status.state = state;
    for (n = 0; n < LIMIT_COUNT; n++)
        if (!contains_state(LIMITS[n].states, state))
            p->violations[n] = 0;
    if (!contains_state(PRESSURISED_STATES, state)) {
        p->status.setpoint_kpa = 0.0f;
        filling_lock(&p->status.filling);
    }
    record_change(p, previous_state, fault);
    return true;
}

static void trip(struct pressure_controller *p, uint8_t fault)
{
    p->armed = false;
    p->requested_kpa = 0.0f;
    p->status.latched_faults[p->status.latched_fault_count++] = fault;
    if (!apply_trigger(p, TRIGGER_TRIPPED, fault))
        record_change(p, p->status.state, fault);
}

/* Set the values at boot. `unexpected_reset`: the watchdog or a brown-out has restarted the board. */
static void pressure_init(struct pressure_controller *p, bool unexpected_reset)
{
    memset(p, 0, sizeof *p);
    board_status_init(&p->status);
    p->last_clear = p->last_test = NO_VALUE;
    if (unexpected_reset)
        trip(p, FAULT_WATCHDOG);
}

/* Reset the arming and the last values of `clear` and `proof_test`, because the host may be a new one. Also reset the
 * zero if the rig is not pressurised. */
static void host_identified(struct pressure_controller *p)
{
    p->armed = false;
    p->last_clear = p->last_test = NO_VALUE;
    apply_trigger(p, TRIGGER_IDENTIFIED, FAULT_NONE);
    if (!contains_state(PRESSURISED_STATES, p->status.state))
        set_zero(&p->status.reading, 0.0f, false);
}

/* Vent from any state. */
static void vent(struct pressure_controller *p)
{
    p->armed = false;
    p->requested_kpa = 0.0f;
    apply_trigger(p, TRIGGER_VENT_REQUESTED, FAULT_NONE);
}

/* If the `clear` value has changed, clear the faults whose cause is gone. A new value also deletes the record of
 * top-ups, but not while the balloon is inflated. No valve moves, because the valves are SAFE in TRIPPED and in
 * VENTING. */
static void clear_faults(struct pressure_controller *p, uint8_t clear)
{
    struct board_status *status = &p->status;
    bool is_new = p->last_clear != NO_VALUE && p->last_clear != clear;
    uint8_t n, left = 0;

    p->last_clear = clear;
    if (!is_new)
        return;
    if (!contains_state(PRESSURISED_STATES, status->state))
        restart_top_ups(&status->top_ups);
    for (n = 0; n < status->latched_fault_count; n++)
        if (!cause_gone(status, status->latched_faults[n]))
            status->latched_faults[left++] = status->latched_faults[n];
    status->latched_fault_count = left;
    if (!left)
        apply_trigger(p, TRIGGER_CLEARED, FAULT_NONE);
}

static uint16_t clamp(uint16_t value, uint16_t minimum, uint16_t maximum)
{
    return value < minimum ? minimum : value > maximum ? maximum : value;
}

/* Store the values of a command that the status contains. */
static void store_values(struct board_status *status, const struct command *c)
{
    status->since_command_ms = 0;
    status->in_contact = (c->flags & FLAG_IN_CONTACT) != 0;
    status->contact_limit_kpa = fminf(c->contact_limit_pa / PA_PER_KPA, HARD_LIMIT_KPA);
    status->host_timeout_ms = clamp(c->host_timeout_ms, MIN_HOST_TIMEOUT_MS, MAX_HOST_TIMEOUT_MS);
    if (!contains_state(PRESSURISED_STATES, status->state))
        set_zero(&status->reading, c->zero_pa / PA_PER_KPA, (c->flags & FLAG_ZEROED) != 0);
}

/* Vent, or store the setpoint. */
static void apply_mode(struct pressure_controller *p, const struct command *c)
{
    bool zeroed = (c->flags & FLAG_ZEROED) != 0;

    if (c->mode == MODE_VENT) {
        vent(p);
        p->armed = p->status.state != STATE_TRIPPED;
    } else if (zeroed && MIN_SETPOINT_PA <= c->setpoint_pa && c->setpoint_pa <= MAX_SETPOINT_PA) {
        p->requested_kpa = c->setpoint_pa / PA_PER_KPA;
    }
}

/* Apply a command of the host. */
static void apply_command(struct pressure_controller *p, const struct command *c)
{
    store_values(&p->status, c);
    clear_faults(p, c->clear);
    p->test_requested = p->last_test != NO_VALUE && p->last_test != c->proof_test;
    p->last_test = c->proof_test;
    apply_mode(p, c);
}

/* Count or reset the violations of one limit. Trip if there are enough violations in a row. */
static void check_limit(struct pressure_controller *p, uint8_t n)
{
    const struct limit *limit = &LIMITS[n];

    if (limit->condition(&p->status)) {
        p->violations[n] = 0;
    } else if (contains_state(limit->states, p->status.state)) {
        p->violations[n] += p->violations[n] < UINT8_MAX;
        if (p->violations[n] >= limit->samples && !is_latched(&p->status, limit->fault))
            trip(p, limit->fault);
    }
}

/* Check the limits of the state at the beginning of this sample. */
static void check_limits(struct pressure_controller *p)
{
    uint8_t n, state = p->status.state;

    for (n = 0; n < LIMIT_COUNT; n++)
        if (contains_state(LIMITS[n].states, state))
            check_limit(p, n);
}

static void start_filling(struct pressure_controller *p)
{
    p->status.setpoint_kpa = p->requested_kpa;
    filling_start(&p->status.filling, &p->status.reading);
    p->status.top_ups.low_ms = 0;
}

static uint8_t step_vented(struct pressure_controller *p)
{
    if (!(p->armed && p->requested_kpa > 0 && p->status.reading.zeroed && may_move_valves(&p->status)))
        return NO_TRIGGER;
    start_filling(p);
    return TRIGGER_HOLD_REQUESTED;
}

static uint8_t step_filling(struct pressure_controller *p)
{
    struct board_status *status = &p->status;

    if (p->requested_kpa != status->setpoint_kpa)
        start_filling(p);
    filling_step(&status->filling, &status->reading);
    if (!may_move_valves(status)) {
        filling_lock(&status->filling);
        return NO_TRIGGER;
    }
    return status->state == STATE_INFLATING ? inflate(&status->filling, &status->reading, status->setpoint_kpa)
                                            : settle(&status->filling, &status->reading, status->setpoint_kpa);
}

static uint8_t start_test(struct board_status *status)
{
    proof_test_start(&status->proof_test, status->setpoint_kpa, &status->reading);
    return TRIGGER_TEST_REQUESTED;
}

static uint8_t step_holding(struct pressure_controller *p)
{
    struct board_status *status = &p->status;

    if (!(p->armed && may_move_valves(status)) || status->in_contact)
        return NO_TRIGGER;
    if (top_up_due(&status->top_ups))
        record_top_up(&status->top_ups);
    else if (p->requested_kpa == status->setpoint_kpa)
        return p->test_requested ? start_test(status) : NO_TRIGGER;
    start_filling(p);
    return TRIGGER_RETARGETED;
}

static uint8_t step_testing(struct board_status *status)
{
    proof_test_step(&status->proof_test, &status->reading);
    return proof_test_finished(&status->proof_test) ? TRIGGER_TEST_FINISHED : NO_TRIGGER;
}

static uint8_t step_state(struct pressure_controller *p)
{
    switch (p->status.state) {
    case STATE_BOOT:
    case STATE_VENTING:
        return p->status.vent.verified ? TRIGGER_VENT_VERIFIED : NO_TRIGGER;
    case STATE_VENTED:
        return step_vented(p);
    case STATE_INFLATING:
    case STATE_SETTLING:
        return step_filling(p);
    case STATE_HOLDING:
        return step_holding(p);
    case STATE_TESTING:
        return step_testing(&p->status);
    default:
        return NO_TRIGGER;
    }
}

static uint8_t valves_of(const struct board_status *status)
{
    if (contains_state(FILLING_STATES, status->state))
        return status->filling.valves;
    if (status->state == STATE_TESTING)
        return proof_test_valves(&status->proof_test, may_move_valves(status));
    return status->state == STATE_HOLDING ? LOCKED : SAFE;
}

/* Process one sample and set the valves. */
static void pressure_step(struct pressure_controller *p, uint16_t adc_sum, uint16_t supply_mv)
{
    uint8_t trigger;

    board_status_update(&p->status, adc_sum, supply_mv);
    p->armed = p->armed && (host_active(&p->status) || contains_state(PRESSURISED_STATES, p->status.state));
    check_limits(p);
    trigger = step_state(p);
    if (trigger != NO_TRIGGER)
        apply_trigger(p, trigger, FAULT_NONE);
    p->test_requested = false;
    p->status.valves = valves_of(&p->status);
}

#endif
