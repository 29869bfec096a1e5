"""Tests of the diagnosis and of the time stamps of the ROS 2 node. They need no ROS."""

import math

import pytest
from pneuforce_ros.diagnosis import ERROR, OK, WARN, connection_lost, diagnose
from pneuforce_ros.sample_time import SAMPLE_PERIOD_NS, sample_time_ns

from pneuforce import Measurement, State, Status
from pneuforce.registers.advice import STATUS_ADVICE

HOLDING = frozenset({Status.HOLDING})
NOW_NS = 1_700_000_000_000_000_000


def held(*status, force_n=1.0):
    return Measurement(force_or_nan=force_n, state=State.HOLDING, status_or_none=HOLDING | set(status))


@pytest.mark.parametrize(
    ("measurement", "level"),
    [
        (held(), OK),
        (held(Status.IN_CONTACT, Status.CALIBRATED), OK),
        (held(Status.FUNCTION_CHECK, force_n=math.nan), OK),  # the proof test
        (
            Measurement(state=State.VENTED, status_or_none=frozenset({Status.VENTED, Status.FUNCTION_CHECK})),
            OK,
        ),
        (Measurement(force_or_nan=1.0), OK),  # RDT transmits only the force
        (held(Status.SIMULATED), WARN),
        (held(Status.OUT_OF_RANGE, force_n=math.nan), WARN),
        (held(Status.FORCE_HIGH_ALARM), WARN),
        (Measurement(state=State.BOOT), WARN),
        (held(Status.FAILURE), ERROR),
        (held(Status.STALE, force_n=math.nan), ERROR),
        (Measurement(state=State.TRIPPED), ERROR),
        (Measurement(status_or_none=frozenset({Status.STALE})), ERROR),
        (Measurement(), ERROR),
    ],
)
def test_the_level_follows_from_state_and_status(measurement, level):
    assert diagnose(measurement).level == level


@pytest.mark.parametrize("status", [s for s in Status if diagnose(held(s)).level != OK])
def test_each_notable_condition_is_shown_with_its_remedy(status):
    diagnosis = diagnose(held(status))
    assert STATUS_ADVICE[status.value].do in dict(diagnosis.values)[status.value]
    assert STATUS_ADVICE[status.value].do in diagnosis.message


def test_a_summary_does_not_hide_the_cause():
    status = {Status.FAILURE, Status.ANY_FAILURE, Status.SIMULATED, Status.VENT_FAULT}
    assert diagnose(held(*status)).message.startswith("vent_fault")


def test_the_explanation_of_a_trip_is_shown_only_while_the_rig_is_tripped():
    tripped = Measurement(state=State.TRIPPED, status_or_none=frozenset({Status.FAILURE}))
    assert dict(diagnose(tripped, "cause and remedy").values)["fault"] == "cause and remedy"
    assert "fault" not in dict(diagnose(held(), "cause and remedy").values)


def test_an_invalid_force_is_no_number_in_the_values():
    values = dict(diagnose(held(force_n=math.nan)).values)
    assert values["force_valid"] == "false"
    assert not any("nan" in value for value in values.values())


def test_a_lost_connection_is_an_error():
    diagnosis = connection_lost(OSError("cause"))
    assert (diagnosis.level, dict(diagnosis.values)["connected"]) == (ERROR, "false")


def test_the_time_of_a_sample_is_its_age_before_now():
    assert sample_time_ns(NOW_NS, 0.05, NOW_NS - 60_000_000) == NOW_NS - 50_000_000


def test_the_time_of_a_sample_increases_if_the_clock_was_read_late():
    assert sample_time_ns(NOW_NS, 0.01, NOW_NS) == NOW_NS + SAMPLE_PERIOD_NS


def test_the_time_of_a_sample_follows_a_clock_that_was_set_back():
    assert sample_time_ns(NOW_NS, 0.0, NOW_NS + 3_600_000_000_000) == NOW_NS


def test_the_time_of_a_sample_is_never_negative():
    assert sample_time_ns(0, 0.05, 0) >= 0
