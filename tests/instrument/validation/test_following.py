"""How well the force follows its reference while it changes."""

import math

import numpy as np
import pytest

from instrument.chain import ChainSettings
from instrument.cli.measured_scenario import measured
from instrument.validation.continuous import Forces, continuous, forces_of
from instrument.validation.course import courses_of
from instrument.validation.trial import Sample, trials_of
from sim.headless import Playback
from sim.scenario import Scenario
from tests.instrument.validation.pressing import SETTINGS, force_n, trial

PRESS = (1.0, 0.5, 0.5, 2.0)


def forces(compensated_n=None, uncompensated_n=None):
    t_s, truth_n = force_n(5.0, PRESS)
    made = trial(t_s, truth_n)
    shown = truth_n if compensated_n is None else compensated_n(t_s, truth_n)
    late = truth_n if uncompensated_n is None else uncompensated_n(t_s, truth_n)
    return Forces(made, shown, late, (t_s > 0.8) & (t_s < 3.0))


def test_a_force_that_comes_late_is_found_by_hindsight():
    late = forces(uncompensated_n=lambda t_s, _: force_n(5.0, (1.1, *PRESS[1:]))[1])
    told = continuous([late])
    assert told.shift_s == pytest.approx(0.1)
    assert told.shifted_n < 1e-3
    assert told.uncompensated_n > 0.2
    assert told.compensated_n == 0


def test_the_compensated_force_is_never_shifted():
    assert continuous([forces(lambda t_s, _: force_n(5.0, (1.1, *PRESS[1:]))[1])]).compensated_n > 0.2


def test_free_time_is_no_merit():
    told = continuous([forces(lambda t_s, truth_n: truth_n + np.where(t_s > 3.0, 100.0, 0.2))])
    assert told.compensated_n == pytest.approx(0.2)
    assert told.looked_at_s == pytest.approx(2.2, abs=0.01)


def test_time_without_a_force_is_told_and_not_averaged():
    told = continuous([forces(lambda t_s, truth_n: np.where(t_s < 1.8, math.nan, truth_n + 0.1))])
    assert told.without_force_s == pytest.approx(1.0, abs=0.01)
    assert told.compensated_n == pytest.approx(0.1)


def test_without_contacts_there_is_nothing_to_tell():
    told = continuous([])
    assert math.isnan(told.compensated_n)
    assert told.looked_at_s == 0


def test_the_recordings_forces_are_those_that_the_instrument_showed():
    contact = {"kind": "fast", "force_n": [1.8, 2.2, 1.5], "pause_s": 1.0}
    scenario = Scenario(doc="fast", phase=[{"setpoint_kpa": [8.0], "contact": [contact]}])
    settings = ChainSettings()
    held = [pair for pair in measured(Playback(scenario), settings) if math.isfinite(pair[0].initial_kpa)]
    [made] = trials_of(Sample(truth.t_s, m.unfiltered_kpa, truth.force_n, "held") for m, truth in held)
    [course] = courses_of([made], settings)
    again = forces_of(course, settings)
    pressed = np.array([m.in_contact for m, _ in held])
    alike = pressed == (course.contact > 0)
    assert pressed.sum() > 500
    assert (~alike).sum() <= 10  # how soon a contact ends depends a little on the drift of minutes before
    for forces_n, name in (
        (again.compensated_n, "force_n"),
        (again.uncompensated_n, "force_uncompensated_n"),
    ):
        shown_n = np.array([getattr(m, name) for m, _ in held])
        assert np.abs(forces_n - shown_n)[alike].max() < 0.001


def test_a_contact_out_of_range_has_no_force():
    made = trial(*force_n(5.0, PRESS))
    low = type(made)(t_s=made.t_s, pressure_kpa=made.pressure_kpa - 4.0, force_n=made.force_n)
    [course] = courses_of([low], SETTINGS)
    assert np.isnan(forces_of(course, SETTINGS).compensated_n[course.contact > 0]).all()
