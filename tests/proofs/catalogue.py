"""Catalogue of the proved properties: sentence, options of the model checker, and a planted error."""

from typing import NamedTuple

LIMIT_ROWS = 16


class PlantedError(NamedTuple):
    """Change of one header of the firmware that breaks a property. The model checker must find it."""

    header: str
    old: str
    new: str


class Property(NamedTuple):
    """Property of the firmware; `name` is its function in properties.c.

    `checks_memory` is True if array indices, pointers, divisions and signed overflow are checked, too.
    """

    name: str
    sentence: str
    planted: PlantedError
    checks_memory: bool = False
    rows: int = 1  #: number of rows of LIMITS for which the property is proved one after the other
    rounds: int = 26  #: limit for the rounds of a loop; the model checker proves that no loop has more
    any_cause: bool = False  #: the cause of a fault is present or gone at will
    quick: bool = False  #: proved in each `make test`
    #: Also proved with `int` of 16 bits, as on an AVR. The model checker aborts for the other properties.
    avr: bool = False


CONTROL, LIMITS, WIRE = "pressure_control.h", "limits.h", "wire.h"
FILLING, READING, TEST = "filling.h", "reading.h", "proof_test.h"

PROPERTIES = (
    Property(
        "decoder_stays_in_its_buffer",
        "The decoder stays in its buffer, for any byte in any state.",
        PlantedError(WIRE, "d->frame + from, d->held_bytes);", "d->frame + from, FRAME_BYTES);"),
        checks_memory=True,
    ),
    Property(
        "vent_is_safe_from_any_state",
        "A vent makes the valves safe and disarms, from any state.",
        PlantedError(CONTROL, "apply_trigger(p, TRIGGER_VENT_REQUESTED, FAULT_NONE);", ""),
        quick=True,
    ),
    Property(
        "identify_disarms",
        "An Identify disarms, ends an inflation, and keeps a held balloon locked.",
        PlantedError(CONTROL, "apply_trigger(p, TRIGGER_IDENTIFIED, FAULT_NONE);", ""),
    ),
    Property(
        "a_mode_starts_no_inflation",
        "No command inflates: it can only vent, or store a setpoint.",
        PlantedError(
            CONTROL,
            "    if (c->mode == MODE_VENT) {",
            "    p->status.state = STATE_INFLATING;\n    if (c->mode) {",
        ),
    ),
    Property(
        "setpoint_is_0_or_2_to_12_kpa",
        "The requested setpoint is 0, or 2 to 12 kPa, after any command.",
        PlantedError(CONTROL, "MIN_SETPOINT_PA <= c->setpoint_pa && ", ""),
        quick=True,
    ),
    Property(
        "contact_limit_is_at_most_25_kpa",
        "The contact limit is at most 25 kPa after any command.",
        PlantedError(
            CONTROL,
            "fminf(c->contact_limit_pa / PA_PER_KPA, HARD_LIMIT_KPA)",
            "c->contact_limit_pa / PA_PER_KPA",
        ),
        quick=True,
    ),
    Property(
        "host_timeout_is_250_ms_to_10_s",
        "The host time-out is 250 ms to 10 s after any command.",
        PlantedError(CONTROL, "minimum : value > maximum ? maximum : value", "minimum : value"),
        quick=True,
    ),
    Property(
        "a_trip_ends_only_by_a_new_clear_value",
        "A trip ends only by a new `clear` value, with no fault latched.",
        PlantedError(CONTROL, "    if (!is_new)\n        return;\n", ""),
        any_cause=True,
    ),
    Property(
        "no_trigger_but_cleared_ends_a_trip",
        "No other trigger ends a trip.",
        PlantedError(
            "numbers.h",
            "STAYS, STAYS, STAYS, STATE_VENTING }, \\",
            "STATE_VENTING, STAYS, STAYS, STATE_VENTING }, \\",
        ),
        avr=True,
    ),
    Property(
        "inflation_begins_only_if_everything_allows_it",
        "VENTED turns into INFLATING only if armed, wanted, zeroed, heard in 250 ms, with a valid sensor.",
        PlantedError(CONTROL, "if (!(p->armed && p->requested_kpa > 0", "if (!(p->requested_kpa > 0"),
    ),
    Property(
        "inlet_is_open_only_while_filling_or_testing",
        "The inlet is open only in INFLATING, SETTLING and TESTING.",
        PlantedError(CONTROL, "== STATE_HOLDING ? LOCKED : SAFE;", "== STATE_HOLDING ? FILL : SAFE;"),
        quick=True,
        avr=True,
    ),
    Property(
        "a_silent_host_shuts_the_inlet",
        "The inlet is shut if the host has been silent for more than 250 ms.",
        PlantedError(
            CONTROL,
            "        filling_lock(&status->filling);\n        return NO_TRIGGER;",
            "        return NO_TRIGGER;",
        ),
    ),
    Property(
        "an_invalid_sensor_shuts_the_inlet",
        "The inlet is shut while the sensor is invalid.",
        PlantedError(
            "board_status.h", "return host_active(s) && s->reading.sensor_ok;", "return host_active(s);"
        ),
    ),
    Property(
        "the_proof_test_opens_the_inlet_for_at_most_16_ms",
        "A proof test opens the inlet for at most 16 ms, and only with an active host and a valid sensor.",
        PlantedError(TEST, "t->elapsed_ms < TEST_PULSE_MS", "t->elapsed_ms < TEST_HALF_MS"),
        quick=True,
        avr=True,
    ),
    Property(
        "a_limit_latches_each_fault_once",
        "Each fault is latched at most once, so the latched faults fit into their array (all 16 rows).",
        PlantedError(CONTROL, " && !is_latched(&p->status, limit->fault))", ")"),
        rows=LIMIT_ROWS,
    ),
    Property(
        "after_a_boot_only_a_latched_fault_trips",
        "After a boot the valves are safe, nothing is armed, and only an unexpected reset trips.",
        PlantedError("board_status.h", "s->state = STATE_BOOT;", "s->state = STATE_INFLATING;"),
        rounds=600,
    ),
    Property(
        "above_25_kpa_the_hard_limit_trips",
        "Above 25 kPa, or without a pressure (NaN), every state trips and is safe.",
        PlantedError(
            LIMITS,
            "return s->reading.pressure_kpa <= HARD_LIMIT_KPA;",
            "return !(s->reading.pressure_kpa > HARD_LIMIT_KPA);",
        ),
    ),
    Property(
        "an_invalid_sensor_trips_after_five_samples",
        "After five invalid samples of the sensor, every state trips and is safe.",
        PlantedError(CONTROL, "p->violations[n] >= limit->samples", "p->violations[n] > limit->samples"),
    ),
    Property(
        "a_host_silent_beyond_its_time_out_trips",
        "If the host is silent beyond its time-out, every inflated state trips and vents.",
        PlantedError("numbers.h", "ROW(FAULT_HOST_SILENT, 0x9Cu,", "ROW(FAULT_HOST_SILENT, 0x8Cu,"),
    ),
    Property(
        "a_limit_only_trips",
        "No limit changes the state except to TRIPPED (all 16 rows).",
        PlantedError(
            CONTROL,
            "(limit->condition(&p->status)) {",
            "(limit->condition(&p->status)) {\n        p->status.state = STATE_VENTED;",
        ),
        rows=LIMIT_ROWS,
    ),
    Property(
        "a_trip_disarms",
        "A trip disarms, deletes the setpoint, and is safe.",
        PlantedError(
            CONTROL,
            "    p->armed = false;\n    p->requested_kpa = 0.0f;\n    p->status.latched",
            "    p->status.latched",
        ),
    ),
    Property(
        "a_pulse_lasts_at_most_500_ms",
        "A pulse of a valve lasts at most 500 ms; its duration is computed without overflow.",
        PlantedError(
            FILLING,
            "requested_ms <= MAX_PULSE_MS ? (uint16_t)requested_ms : MAX_PULSE_MS",
            "(uint16_t)requested_ms",
        ),
        checks_memory=True,
    ),
    Property(
        "every_adc_sum_gives_a_possible_pressure",
        "Each possible ADC sum gives a pressure between −10 and 60 kPa.",
        PlantedError(READING, "const float kpa_per_count = 1.0f /", "const float kpa_per_count = 2.0f /"),
        checks_memory=True,
    ),
    Property(
        "a_zero_is_at_most_1_3_kpa",
        "A zero is within ±1.3 kPa, whatever the host sends, NaN included.",
        PlantedError(READING, "zeroed && -ZERO_SPAN_KPA <= zero_kpa && zero_kpa <= ZERO_SPAN_KPA", "zeroed"),
    ),
    Property(
        "elapsed_time_never_wraps",
        "A counter of time stops at its maximum.",
        PlantedError("elapsed.h", "    if (*since_ms <= UINT16_MAX - SAMPLE_MS)\n", ""),
        checks_memory=True,
        quick=True,
        avr=True,
    ),
    Property(
        "the_history_stays_in_its_array",
        "The history of the pressure stays in its array.",
        PlantedError(READING, "r->oldest + 1u < HISTORY_SAMPLES", "r->oldest < HISTORY_SAMPLES"),
        checks_memory=True,
        quick=True,
    ),
    Property(
        "the_supply_monitor_stays_in_its_array",
        "The supply monitor stays in its array and never divides by zero.",
        PlantedError(
            "supply.h", "    if (s->history_count < SUPPLY_SAMPLES)\n        s->history_count++;\n", ""
        ),
        checks_memory=True,
        quick=True,
    ),
)
