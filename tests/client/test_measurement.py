"""Tests of a measurement: an invalid force cannot be used, and all names are those of the register map."""

import dataclasses
import math

import pytest

from pneuforce import InvalidForce, Measurement, State, Status, UsageError
from pneuforce.client.measurement import state_of, status_of
from pneuforce.registers.codes import STATES, STATUS


def test_states_and_conditions_are_those_of_the_register_map():
    assert [state.value for state in State] == list(STATES.names.values())
    assert [status.value for status in Status] == [bit.name for bit in STATUS.bits]


def test_unknown_names_of_a_newer_instrument_are_ignored():
    assert state_of("7?") is None
    assert status_of(["holding", "new_bit"]) == {Status.HOLDING}


def test_a_valid_force_is_a_number():
    measurement = Measurement(force_or_nan=1.5, force_std_or_nan=0.1)
    assert (measurement.valid, measurement.force_n, measurement.force_std_n) == (True, 1.5, 0.1)
    assert measurement.reasons == ()
    assert measurement.explanation == ""


@pytest.mark.parametrize("force", [math.nan, math.inf, -math.inf])
def test_an_invalid_force_raises_in_every_use(force):
    measurement = Measurement(
        force_or_nan=force, state=State.TRIPPED, status_or_none=frozenset({Status.FAILURE, Status.STALE})
    )
    assert not measurement.valid
    for use in (lambda m: m.force_n > 1.5, lambda m: m.force_std_n, lambda m: f"{m.force_n:.3f}"):
        with pytest.raises(InvalidForce) as caught:
            use(measurement)
        assert caught.value.reasons == ("stale", "failure")


def test_a_missing_force_without_a_condition_has_an_explanation_with_a_remedy():
    explanation = Measurement(state=State.HOLDING, status_or_none=frozenset({Status.HOLDING})).explanation
    assert "vent, and hold again" in explanation


@pytest.mark.parametrize("use", [lambda m: Status.FORCE_HIGH_ALARM in m.status, lambda m: not m.status])
def test_a_status_that_the_bus_does_not_transmit_is_not_read_as_no_alarm(use):
    for measurement in (Measurement(force_or_nan=1.0), Measurement()):
        with pytest.raises(UsageError, match="does not transmit"):
            use(measurement)
        assert measurement.status_or_none is None
        assert not measurement.balloon_empty


def test_without_a_status_the_reason_is_a_missing_sample_or_unknown():
    unknown, stale = Measurement(sample_counter=7), Measurement()
    assert (unknown.reasons, unknown.remedy) == ((), "")
    assert "does not transmit the reason" in unknown.explanation
    assert stale.reasons == ("stale",)
    assert stale.explanation.startswith("stale: ")


def test_a_bus_without_the_uncertainty_gives_none():
    assert Measurement(force_or_nan=1.0).force_std_n is None


def test_a_measurement_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Measurement().force_or_nan = 0.0
    assert not Measurement().valid


def test_after_a_trip_the_remedy_is_that_of_the_fault():
    status = frozenset({Status.NOT_ZEROED, Status.FAILURE})
    assert "zero" in Measurement(state=State.VENTED, status_or_none=status - {Status.FAILURE}).remedy
    assert "fault" in Measurement(state=State.TRIPPED, status_or_none=status).remedy
