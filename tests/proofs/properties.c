/* Properties of the firmware, for the model checker ESBMC. Each function is one property: it takes any state that the
 * assumptions allow, calls the unmodified code of firmware/pneuforce, and asserts what must be true afterwards.
 * A local variable without a value stands for every value. ESBMC also checks each array index, pointer, division,
 * shift and signed overflow on the way. */
#include <assert.h>

#include "limits.h"

void __ESBMC_assume(_Bool);
_Bool nondet_bool(void);

#ifdef ANY_CAUSE
/* Let the cause of a fault be present or gone at will: what is proved then holds for every condition. */
#define cause_gone(status, fault) nondet_bool()
#endif
#include "board.h"

/* Return true if no counter or index of the controller points outside its array. */
static bool consistent(const struct pressure_controller *p)
{
    const struct board_status *s = &p->status;
    uint8_t n;

    for (n = 0; n < s->latched_fault_count && n < LIMIT_COUNT; n++)
        if (s->latched_faults[n] >= 16)
            return false;
    return s->state < STATE_COUNT && s->latched_fault_count < LIMIT_COUNT && p->change_count <= MAX_CHANGES &&
           s->reading.history_count <= HISTORY_SAMPLES && s->reading.oldest < HISTORY_SAMPLES;
}

/* Return how often a fault is latched. If it is at most once for each of the 15 faults, they fit into their array. */
static uint8_t times_latched(const struct board_status *s, uint8_t fault)
{
    uint8_t n, times = 0;

    for (n = 0; n < s->latched_fault_count && n < LIMIT_COUNT; n++)
        times += s->latched_faults[n] == fault;
    return times;
}

/* Assume any consistent controller. */
#define ANY_CONTROLLER(p)         \
    struct pressure_controller p; \
    __ESBMC_assume(consistent(&p))

static bool inlet_open(const struct pressure_controller *p)
{
    return (valves_of(&p->status) & VALVE_INLET_OPEN) != 0;
}

/* ---- bytes */

void decoder_stays_in_its_buffer(void)
{
    struct frame_decoder d;
    uint8_t byte;

    __ESBMC_assume(d.held_bytes <= FRAME_BYTES);
    decode(&d, byte);
    assert(d.held_bytes <= FRAME_BYTES);
}

/* ---- commands */

void vent_is_safe_from_any_state(void)
{
    ANY_CONTROLLER(p);
    vent(&p);
    assert(valves_of(&p.status) == SAFE);
    assert(!p.armed && p.requested_kpa == 0);
}

void identify_disarms(void)
{
    ANY_CONTROLLER(p);
    uint8_t before = p.status.state;

    host_identified(&p);
    assert(!p.armed);
    if (contains_state(FILLING_STATES, before))
        assert(valves_of(&p.status) == SAFE);
    if (before == STATE_HOLDING)
        assert(p.status.state == STATE_HOLDING);
}

void a_mode_starts_no_inflation(void)
{
    ANY_CONTROLLER(p);
    struct command c;
    uint8_t before = p.status.state;

    apply_mode(&p, &c);
    assert(p.status.state == before || p.status.state == STATE_VENTING);
}

void setpoint_is_0_or_2_to_12_kpa(void)
{
    ANY_CONTROLLER(p);
    struct command c;

    __ESBMC_assume(p.requested_kpa == 0 || (2.0f <= p.requested_kpa && p.requested_kpa <= 12.0f));
    apply_mode(&p, &c);
    assert(p.requested_kpa == 0 || (2.0f <= p.requested_kpa && p.requested_kpa <= 12.0f));
}

void contact_limit_is_at_most_25_kpa(void)
{
    struct board_status s;
    struct command c;

    store_values(&s, &c);
    assert(s.contact_limit_kpa <= 25.0f);
}

void host_timeout_is_250_ms_to_10_s(void)
{
    struct board_status s;
    struct command c;

    store_values(&s, &c);
    assert(250 <= s.host_timeout_ms && s.host_timeout_ms <= 10000);
}

void a_trip_ends_only_by_a_new_clear_value(void)
{
    ANY_CONTROLLER(p);
    uint8_t clear;
    int16_t before = p.last_clear;

    p.status.state = STATE_TRIPPED;
    clear_faults(&p, clear);
    if (p.status.state != STATE_TRIPPED)
        assert(p.status.latched_fault_count == 0 && before != NO_VALUE && before != clear);
}

void no_trigger_but_cleared_ends_a_trip(void)
{
    ANY_CONTROLLER(p);
    uint8_t trigger;

    __ESBMC_assume(trigger < TRIGGER_COUNT && p.status.state == STATE_TRIPPED);
    apply_trigger(&p, trigger, FAULT_NONE);
    assert(p.status.state == STATE_TRIPPED || trigger == TRIGGER_CLEARED);
}

/* ---- steps */

void inflation_begins_only_if_everything_allows_it(void)
{
    ANY_CONTROLLER(p);
    bool allowed = p.armed && p.requested_kpa > 0 && p.status.reading.zeroed && p.status.reading.sensor_ok &&
                   p.status.since_command_ms <= HOST_SILENCE_MS;

    __ESBMC_assume(p.status.state == STATE_VENTED);
    if (step_state(&p) != NO_TRIGGER)
        assert(allowed);
}

void inlet_is_open_only_while_filling_or_testing(void)
{
    ANY_CONTROLLER(p);

    if (inlet_open(&p))
        assert(p.status.state == STATE_INFLATING || p.status.state == STATE_SETTLING ||
               p.status.state == STATE_TESTING);
}

void a_silent_host_shuts_the_inlet(void)
{
    ANY_CONTROLLER(p);
    uint8_t trigger;

    __ESBMC_assume(p.status.since_command_ms > HOST_SILENCE_MS);
    trigger = step_state(&p);
    if (trigger != NO_TRIGGER)
        apply_trigger(&p, trigger, FAULT_NONE);
    assert(!inlet_open(&p));
}

void an_invalid_sensor_shuts_the_inlet(void)
{
    ANY_CONTROLLER(p);
    uint8_t trigger;

    __ESBMC_assume(!p.status.reading.sensor_ok);
    trigger = step_state(&p);
    if (trigger != NO_TRIGGER)
        apply_trigger(&p, trigger, FAULT_NONE);
    assert(!inlet_open(&p));
}

void the_proof_test_opens_the_inlet_for_at_most_16_ms(void)
{
    ANY_CONTROLLER(p);

    __ESBMC_assume(p.status.state == STATE_TESTING);
    if (inlet_open(&p))
        assert(p.status.proof_test.elapsed_ms < 16 && host_active(&p.status) && p.status.reading.sensor_ok);
}

/* ---- limits: `check_limits` calls `check_limit` for each row of LIMITS that applies in the state */

/* Row of LIMITS. The runner proves a property for each row. */
#ifndef ROW
#define ROW 0
#endif

void a_limit_only_trips(void)
{
    ANY_CONTROLLER(p);
    uint8_t before = p.status.state;

    check_limit(&p, ROW);
    assert(p.status.state == before || p.status.state == STATE_TRIPPED);
    assert(!inlet_open(&p) || before != STATE_TRIPPED);
}

/* Assume that the state is tripped exactly while a fault is latched. */
#define ASSUME_TRIPPED_IF_LATCHED(p) \
    __ESBMC_assume(((p).status.state == STATE_TRIPPED) == ((p).status.latched_fault_count > 0))

void a_limit_latches_each_fault_once(void)
{
    ANY_CONTROLLER(p);
    uint8_t fault;

    __ESBMC_assume(times_latched(&p.status, fault) <= 1);
    check_limit(&p, ROW);
    assert(times_latched(&p.status, fault) <= 1);
}

void above_25_kpa_the_hard_limit_trips(void)
{
    ANY_CONTROLLER(p);

    ASSUME_TRIPPED_IF_LATCHED(p);
    __ESBMC_assume(!(p.status.reading.pressure_kpa <= 25.0f)); /* also NaN */
    assert(LIMITS[2].fault == FAULT_OVERPRESSURE && LIMITS[2].samples == 1);
    assert(contains_state(LIMITS[2].states, p.status.state));
    check_limit(&p, 2);
    assert(p.status.state == STATE_TRIPPED && valves_of(&p.status) == SAFE);
}

void after_a_boot_only_a_latched_fault_trips(void)
{
    struct pressure_controller p;
    bool unexpected_reset;

    pressure_init(&p, unexpected_reset);
    assert(valves_of(&p.status) == SAFE && !p.armed && p.status.latched_fault_count == unexpected_reset);
    assert((p.status.state == STATE_TRIPPED) == unexpected_reset);
}

void an_invalid_sensor_trips_after_five_samples(void)
{
    ANY_CONTROLLER(p);

    ASSUME_TRIPPED_IF_LATCHED(p);
    __ESBMC_assume(!p.status.reading.sensor_ok && p.violations[0] >= 4);
    assert(LIMITS[0].fault == FAULT_SENSOR && contains_state(LIMITS[0].states, p.status.state));
    check_limit(&p, 0);
    assert(p.status.state == STATE_TRIPPED && valves_of(&p.status) == SAFE);
}

void a_host_silent_beyond_its_time_out_trips(void)
{
    ANY_CONTROLLER(p);

    ASSUME_TRIPPED_IF_LATCHED(p);
    __ESBMC_assume(contains_state(PRESSURISED_STATES, p.status.state));
    __ESBMC_assume(p.status.since_command_ms > p.status.host_timeout_ms);
    assert(LIMITS[15].fault == FAULT_HOST_SILENT && contains_state(LIMITS[15].states, p.status.state));
    check_limit(&p, 15);
    assert(p.status.state == STATE_TRIPPED && valves_of(&p.status) == SAFE);
}

void a_trip_disarms(void)
{
    ANY_CONTROLLER(p);
    uint8_t fault;

    __ESBMC_assume(0 < fault && fault < 16 && p.status.latched_fault_count < LIMIT_COUNT - 1);
    trip(&p, fault);
    assert(!p.armed && p.requested_kpa == 0 && p.status.state == STATE_TRIPPED && valves_of(&p.status) == SAFE);
}

/* ---- arithmetic */

/* Return true for a pressure that the ADC and any valid zero can give. */
static bool possible(float kpa)
{
    return -10.0f <= kpa && kpa <= 60.0f;
}

void a_pulse_lasts_at_most_500_ms(void)
{
    struct fill_controller f;
    float error_kpa;

    __ESBMC_assume(-70.0f <= error_kpa && error_kpa <= 70.0f && error_kpa != 0);
    start_pulse(&f, error_kpa);
    assert(f.pulse_left_ms <= 500);
}

void every_adc_sum_gives_a_possible_pressure(void)
{
    uint16_t adc_sum;

    __ESBMC_assume(adc_sum <= MAX_ADC_SUM);
    assert(possible(nominal_pressure_kpa(adc_sum)));
}

void a_zero_is_at_most_1_3_kpa(void)
{
    struct pressure_reading r;
    float zero_kpa;
    bool zeroed;

    __ESBMC_assume(possible(r.pressure_kpa) && possible(r.filtered_kpa) && -1.3f <= r.zero_kpa && r.zero_kpa <= 1.3f);
    set_zero(&r, zero_kpa, zeroed);
    assert(-1.3f <= r.zero_kpa && r.zero_kpa <= 1.3f);
    assert(zeroed || !r.zeroed);
}

void elapsed_time_never_wraps(void)
{
    uint16_t before, after;

    after = before;
    elapse(&after);
    assert(after >= before && after - before <= SAMPLE_MS);
}

void the_history_stays_in_its_array(void)
{
    struct pressure_reading r;

    __ESBMC_assume(r.history_count <= HISTORY_SAMPLES && r.oldest < HISTORY_SAMPLES);
    add_to_history(&r);
    assert(r.history_count <= HISTORY_SAMPLES && r.oldest < HISTORY_SAMPLES);
    past_kpa(&r);
}

void the_supply_monitor_stays_in_its_array(void)
{
    struct supply_monitor s;
    uint16_t supply_mv;

    __ESBMC_assume(s.history_count <= SUPPLY_SAMPLES && s.oldest < SUPPLY_SAMPLES);
    supply_step(&s, supply_mv);
    assert(s.history_count <= SUPPLY_SAMPLES && s.oldest < SUPPLY_SAMPLES);
}
