"""Tests of the errors of the continuous force, compared with a known reference."""

import math

import numpy as np
import pytest

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.instrument.validation.continuous import TrialForces, compute_forces, continuous_errors
from pneuforce.instrument.validation.processed_trial import process_trials
from pneuforce.instrument.validation.trial import Trial, TrialSample, split_trials
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import Scenario
from tests.instrument.validation.synthetic_trials import SETTINGS, force_n, trial

PRESS = (1.0, 0.5, 0.5, 2.0)


def forces(compensated_n=None, uncompensated_n=None):
    """Return the forces of a trial.

    Each argument is a function of time and true force. Without a function the force is exact.
    """
    t_s, truth_n = force_n(5.0, PRESS)
    compensated = truth_n if compensated_n is None else compensated_n(t_s, truth_n)
    uncompensated = truth_n if uncompensated_n is None else uncompensated_n(t_s, truth_n)
    return TrialForces(trial(t_s, truth_n), compensated, uncompensated, (t_s > 0.8) & (t_s < 3.0))


def delayed(_t_s, _truth_n):
    """Return the force of the same press, 0.1 s later."""
    return force_n(5.0, (1.1, *PRESS[1:]))[1]


def test_the_shift_compensates_a_constant_delay():
    errors = continuous_errors([forces(uncompensated_n=delayed)])
    assert errors.shift_s == pytest.approx(0.1)
    assert errors.shifted_n < 1e-3
    assert errors.uncompensated_n > 0.2
    assert errors.compensated_n == 0


def test_the_compensated_force_is_never_shifted():
    assert continuous_errors([forces(compensated_n=delayed)]).compensated_n > 0.2


def test_free_time_is_not_evaluated():
    wrong_when_free = forces(lambda t_s, truth_n: truth_n + np.where(t_s > 3.0, 100.0, 0.2))
    errors = continuous_errors([wrong_when_free])
    assert errors.compensated_n == pytest.approx(0.2)
    assert errors.evaluated_s == pytest.approx(2.2, abs=0.01)


def test_time_without_a_force_is_counted_and_not_averaged():
    missing_until_1_8_s = forces(lambda t_s, truth_n: np.where(t_s < 1.8, math.nan, truth_n + 0.1))
    errors = continuous_errors([missing_until_1_8_s])
    assert errors.without_force_s == pytest.approx(1.0, abs=0.01)
    assert errors.compensated_n == pytest.approx(0.1)


def test_without_contacts_the_errors_are_nan():
    errors = continuous_errors([])
    assert math.isnan(errors.compensated_n)
    assert errors.evaluated_s == 0


def test_the_forces_of_a_recording_are_those_that_the_live_instrument_showed():
    contact = {"kind": "fast", "force_n": [1.8, 2.2, 1.5], "pause_s": 1.0}
    scenario = Scenario(doc="fast", phase=[{"setpoint_kpa": [8.0], "contact": [contact]}])
    settings = ChainSettings()
    pairs = measure_playback(Playback(scenario), settings)
    locked = [(m, truth) for m, truth in pairs if math.isfinite(m.baseline_kpa)]
    [recorded] = split_trials(
        TrialSample(truth.t_s, m.unfiltered_kpa, truth.force_n, "locked") for m, truth in locked
    )
    [processed] = process_trials([recorded], settings)
    computed = compute_forces(processed, settings)
    in_contact = np.array([m.in_contact for m, _ in locked])
    same = in_contact == (processed.contact > 0)
    assert in_contact.sum() > 500
    # The end of a contact depends slightly on the earlier drift, which a trial does not contain.
    assert (~same).sum() <= 10
    for computed_n, name in (
        (computed.compensated_n, "force_n"),
        (computed.uncompensated_n, "force_uncompensated_n"),
    ):
        shown_n = np.array([getattr(m, name) for m, _ in locked])
        assert np.abs(computed_n - shown_n)[same].max() < 0.001


def test_a_contact_out_of_range_has_no_force():
    valid = trial(*force_n(5.0, PRESS))
    low = Trial(t_s=valid.t_s, pressure_kpa=valid.pressure_kpa - 4.0, force_n=valid.force_n)
    [processed] = process_trials([low], SETTINGS)
    assert np.isnan(compute_forces(processed, SETTINGS).compensated_n[processed.contact > 0]).all()


def test_the_force_is_not_evaluated_before_the_object_of_the_start_of_the_trial_is_removed():
    t_s, truth_n = force_n(8.0, (1.5, 0.3, 0.3, 2.0), (6.0, 0.3, 0.3, 2.0))
    truth_n = np.maximum(truth_n, np.where(t_s < 4.0, 0.5, 0.0))
    [processed] = process_trials([trial(t_s, truth_n)], SETTINGS)
    evaluated_s = t_s[compute_forces(processed, SETTINGS).evaluated]
    assert 4.0 < evaluated_s.min() < evaluated_s.max() < 8.0
    assert ((evaluated_s > 6.1) & (evaluated_s < 6.8)).any()
