"""Tests of the maximum and the minimum of the valid force."""

import math

import pytest

from pneuforce.instrument.measurement.force_extremes import ForceExtremes
from pneuforce.protocol.frames import BoardState
from tests.instrument.instrument_harness import HOLD_8, KEY, ROBOT, VENT, InstrumentHarness

RESET = KEY | {"command_code": "reset_force_extremes", "command_argument": 0}


def extremes(harness):
    seen = harness.snapshot()
    return seen.force_minimum_n, seen.force_maximum_n


def press(harness, push_kpa, seconds=0.4):
    """Press for a time. Return the forces of all samples."""
    harness.push_kpa = push_kpa
    return [harness.feed().force_n for _ in range(round(seconds / 0.002))]


def test_nan_changes_no_extreme():
    extremes = ForceExtremes()
    for force_n in (math.nan, 2.0, math.nan, -1.0, 1.0, math.nan):
        extremes.add(force_n)
    assert (extremes.minimum_n, extremes.maximum_n) == (-1.0, 2.0)


def test_without_a_valid_force_there_are_no_extremes():
    harness = InstrumentHarness.ready()
    assert all(map(math.isnan, extremes(harness)))
    harness.write_ok(HOLD_8)
    harness.run(0.3)  # inflating
    assert all(map(math.isnan, extremes(harness)))


def test_the_extremes_are_those_of_all_samples():
    harness = InstrumentHarness.holding()
    forces = press(harness, 2.0) + press(harness, 0.5)
    assert max(forces) > 1.0
    assert extremes(harness) == (0.0, max(forces))


def test_a_reset_in_a_contact_restarts_the_minimum_at_a_force():
    harness = InstrumentHarness.holding()
    press(harness, 2.0, 0.8)
    harness.write_ok(RESET | {"command_sequence": 1})
    assert all(map(math.isnan, extremes(harness)))
    forces = press(harness, 1.0)
    assert extremes(harness) == (min(forces), max(forces))
    assert extremes(harness)[0] > 0.2


def test_an_inflation_does_not_reset_the_extremes():
    harness = InstrumentHarness.holding()
    press(harness, 2.0)
    before = extremes(harness)
    harness.push_kpa = 0.0
    harness.write_ok(VENT)
    harness.run(1.0)
    harness.write_ok(HOLD_8)
    harness.run(1.0)
    assert extremes(harness) == before


def test_a_sample_that_violates_an_interlock_is_not_an_extreme():
    harness = InstrumentHarness.holding(contact_limit_kpa=9.5)
    harness.push_kpa = 3.0
    seen = [0.0]
    while not harness.instrument.tripped:
        seen.append(harness.feed().force_n)
    assert extremes(harness)[1] <= max(seen[:-1])
    harness.feed(state=BoardState.HOLDING)
    assert extremes(harness)[1] <= max(seen[:-1])


def test_the_force_that_vents_at_the_force_limit_is_an_extreme():
    harness = InstrumentHarness.holding(vent_on_force_limit=True)
    harness.write_ok({"force_limit_n": 0.5})
    harness.push_kpa = 2.0
    harness.run(1.0, lambda: harness.instrument.tripped)
    assert extremes(harness)[1] == harness.instrument.measurement.force_n


@pytest.mark.parametrize(
    "situation", [InstrumentHarness.new, InstrumentHarness.zeroed, InstrumentHarness.holding]
)
def test_the_reset_is_possible_in_each_state(situation):
    assert situation().write(RESET | {"command_sequence": 1}) == "none"


def test_the_reset_of_another_peer_is_rejected_during_a_lease():
    harness = InstrumentHarness.holding(request={"lease_s": 5.0})
    press(harness, 1.0)
    assert harness.write(RESET | {"command_sequence": 1}, ROBOT) == "lease"
    assert extremes(harness)[1] > 0
