"""Errors of the continuous force: with lag compensation, without it, and with the best time shift."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.validation.accuracy import estimate_forces
from pneuforce.instrument.validation.processed_trial import ProcessedTrial
from pneuforce.instrument.validation.trial import Bools, Floats, Trial

#: Time before and after a contact that is also evaluated. The remaining time without contact is excluded,
#: because its force of zero would improve the mean.
CONTACT_MARGIN_S = 0.2
SHIFTS_S = np.arange(0.0, 0.3005, 0.005)


class TrialForces(NamedTuple):
    """Forces [N] of one trial, one element for each sample. NaN if the instrument shows no force."""

    trial: Trial
    compensated_n: Floats  #: force that the instrument shows, with the lag of the tube compensated
    uncompensated_n: Floats  #: force from the filtered pressure, by the same force law
    #: True if the sample is in a contact, or within `CONTACT_MARGIN_S` of a contact, and the balloon has been
    #: free before
    evaluated: Bools


class ContinuousErrors(NamedTuple):
    """Root mean square differences [N] from the unfiltered reference force, in and around contacts."""

    compensated_n: float
    uncompensated_n: float
    shifted_n: float  #: uncompensated force, moved earlier by `shift_s`
    shift_s: float  #: time shift for which `shifted_n` is smallest
    evaluated_s: float  #: time in and around contacts
    without_force_s: float  #: part of `evaluated_s` in which the instrument shows no force


def compute_forces(processed: ProcessedTrial, settings: ChainSettings) -> TrialForces:
    """Return the forces of a trial, with the force calibration of the settings if there is one."""
    pressed = processed.contact > 0
    baseline_kpa = processed.baseline_kpa[pressed]
    in_range = (baseline_kpa >= VALID_LOW_KPA) & (baseline_kpa <= VALID_HIGH_KPA)
    forces = []
    for pressure_kpa in (processed.now_kpa, processed.filtered_kpa):
        solved_n = _forces_n(baseline_kpa, pressure_kpa[pressed], settings)
        force_n = np.zeros(len(pressed))
        force_n[pressed] = np.where(in_range, solved_n, np.nan)
        forces.append(force_n)
    trial = processed.trial
    evaluated = _near_contact(pressed, trial.t_s) & processed.was_free
    return TrialForces(trial, forces[0], forces[1], evaluated)


def _forces_n(baseline_kpa: Floats, pressure_kpa: Floats, settings: ChainSettings) -> Floats:
    """Return the force [N] at each pair of pressures [kPa]."""
    if settings.correction is None:
        return np.asarray(settings.force_model.estimate(baseline_kpa, pressure_kpa).force_n)
    return estimate_forces(zip(baseline_kpa, pressure_kpa, strict=True), settings)[0]


def _near_contact(pressed: Bools, t_s: Floats) -> Bools:
    """Return a mask of the samples that are within `CONTACT_MARGIN_S` of a sample in contact."""
    pressed_s = t_s[pressed]
    if not len(pressed_s):
        return pressed
    after = np.searchsorted(pressed_s, t_s)
    next_s = pressed_s[np.minimum(after, len(pressed_s) - 1)]
    last_s = pressed_s[np.maximum(after - 1, 0)]
    return np.minimum(np.abs(next_s - t_s), np.abs(last_s - t_s)) <= CONTACT_MARGIN_S


def continuous_errors(trials: Sequence[TrialForces]) -> ContinuousErrors:
    """Return the errors over all trials. The differences are NaN if there is no contact."""
    shifted_n = [_shifted_rmse_n(trials, shift_s) for shift_s in SHIFTS_S]
    best = int(np.argmin(shifted_n))
    evaluated_s = sum(float(forces.trial.steps_s[forces.evaluated].sum()) for forces in trials)
    without_force_s = sum(
        float(forces.trial.steps_s[forces.evaluated & np.isnan(forces.compensated_n)].sum())
        for forces in trials
    )
    compensated_n = _root_mean_square(
        [(forces.compensated_n - forces.trial.force_n)[forces.evaluated] for forces in trials]
    )
    return ContinuousErrors(
        compensated_n,
        shifted_n[0],
        shifted_n[best],
        float(SHIFTS_S[best]),
        evaluated_s,
        without_force_s,
    )


def _shifted_rmse_n(trials: Sequence[TrialForces], shift_s: float) -> float:
    """Return the root mean square error [N] of the uncompensated force, moved `shift_s` earlier."""
    errors = []
    for forces in trials:
        t_s = forces.trial.t_s[forces.evaluated]
        shifted_n = np.interp(t_s + shift_s, forces.trial.t_s, forces.uncompensated_n)
        errors.append(shifted_n - forces.trial.force_n[forces.evaluated])
    return _root_mean_square(errors)


def _root_mean_square(errors: Sequence[Floats]) -> float:
    """Return the root mean square of the finite errors, NaN if there are none."""
    error = np.concatenate(errors) if errors else np.empty(0)
    known = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
