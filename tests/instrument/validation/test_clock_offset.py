"""Tests of the clock offset between a recording and a reference: accuracy, sign, and ambiguous signals."""

import numpy as np
import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.validation.clock_offset import Signal, correlation_at, estimate_offset

PAUSES_S = (1.0, 2.3, 1.6, 3.1, 1.2, 2.7)


def presses(pauses_s, begin_s=0.0, step_s=0.01, heights=(1.0, 2.0, 1.5, 0.7, 2.5, 1.2)):
    """Return a signal with one press of 1 s after each pause."""
    t_s = np.arange(0.0, sum(pauses_s) + len(pauses_s) + 1.0, step_s)
    starts_s = np.cumsum(pauses_s) + np.arange(len(pauses_s))
    value = sum(
        height * np.clip(np.minimum(t_s - start, start + 1.0 - t_s) * 10, 0, 1)
        for start, height in zip(starts_s, heights, strict=False)
    )
    return Signal(begin_s + t_s, value)


@pytest.mark.parametrize("begin_s", [0.0, -3.21, 1.7e9, 12.345])
def test_the_offset_is_found_for_any_origin_of_the_clock(begin_s):
    recorded = presses(PAUSES_S, step_s=0.002)
    found = estimate_offset(recorded, presses(PAUSES_S, begin_s))
    assert found.offset_s == pytest.approx(-begin_s, abs=0.005)
    assert found.correlation > 0.99


def test_a_reference_that_covers_a_part_of_the_recording_is_enough():
    whole = presses(PAUSES_S)
    part = Signal(whole.t_s[500:1400] - 100.0, whole.value[500:1400])
    assert estimate_offset(whole, part).offset_s == pytest.approx(100.0, abs=0.005)


@pytest.mark.parametrize(
    "reference",
    [
        Signal(np.arange(0.0, 20.0, 0.01), np.full(2000, 3.0)),
        Signal(np.arange(0.0, 20.0, 0.01), np.random.default_rng(1).normal(size=2000)),
        Signal(np.array([0.0, 0.1]), np.array([0.0, 1.0])),
    ],
    ids=["constant", "noise", "two readings"],
)
def test_a_reference_without_the_presses_is_rejected(reference):
    with pytest.raises(ConfigurationError):
        estimate_offset(presses(PAUSES_S), reference)


def test_the_message_about_a_constant_reference_states_the_reason():
    with pytest.raises(ConfigurationError, match=r"constant \(3 N\)"):
        estimate_offset(presses(PAUSES_S), Signal(np.arange(0.0, 20.0, 0.01), np.full(2000, 3.0)))


def test_a_reference_with_the_opposite_sign_is_rejected_with_the_option_that_reverses_it():
    signal = presses(PAUSES_S)
    with pytest.raises(ConfigurationError, match="--invert"):
        estimate_offset(signal, Signal(signal.t_s, -signal.value))


def test_the_correlation_at_a_given_offset_is_high_only_at_the_true_offset():
    recorded, reference = presses(PAUSES_S, step_s=0.002), presses(PAUSES_S, 100.0)
    assert correlation_at(-100.0, recorded, reference) > 0.99
    assert correlation_at(-98.0, recorded, reference) < 0.3
    assert np.isnan(correlation_at(0.0, recorded, reference))
    assert np.isnan(correlation_at(-100.0, recorded, Signal(reference.t_s, np.ones_like(reference.t_s))))


def test_equal_presses_at_equal_times_are_ambiguous():
    regular = presses((2.0,) * 6, heights=(1.0,) * 6)
    with pytest.raises(ConfigurationError, match="ambiguous"):
        estimate_offset(regular, regular)


@pytest.mark.parametrize("error_s", [-1.5, 0.0, 1.2])
def test_the_clocks_of_two_computers_decide_between_several_offsets(error_s):
    regular = presses((4.0,) * 6, heights=(1.0,) * 6)
    found = estimate_offset(regular, regular, error_s)
    assert found.offset_s == pytest.approx(0.0, abs=0.005)


def test_a_clock_with_a_wrong_time_does_not_prevent_the_estimate():
    recorded = presses(PAUSES_S)
    found = estimate_offset(recorded, presses(PAUSES_S, 1.7e9), -1.7e9 + 3600.0)
    assert found.offset_s == pytest.approx(-1.7e9, abs=0.005)


def test_the_offset_of_a_very_long_recording_must_be_given():
    """A file with a wrong time would otherwise need any amount of memory."""
    far = Signal(np.array([0.0, 1e10]), np.array([0.0, 1.0]))
    for recorded, reference in ((far, presses(PAUSES_S)), (presses(PAUSES_S), far)):
        with pytest.raises(ConfigurationError, match="--offset"):
            estimate_offset(recorded, reference)
