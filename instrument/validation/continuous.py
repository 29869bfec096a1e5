"""The force while it changes: the instrument's, the bare one, and that shifted with hindsight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from instrument.chain import ChainSettings
from instrument.model import estimate
from instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.validation.course import Course
from instrument.validation.trial import Bools, Floats, Trial

#: What belongs to a contact before it is recognised, and after it: the free time between is no merit.
AROUND_S = 0.2
SHIFTS_S = np.arange(0.0, 0.3005, 0.005)


class Forces(NamedTuple):
    """Forces [N] of one trial, a value for each sample; NaN where the instrument shows none."""

    trial: Trial
    compensated_n: Floats  #: what the instrument shows: the tube's lag undone as it comes
    uncompensated_n: Floats  #: the same law from the filtered pressure
    near: Bools  #: in contact, or close to one


class Continuous(NamedTuple):
    """Root mean squares of the distance [N] to the reference as it was, in and around contacts."""

    compensated_n: float
    uncompensated_n: float
    shifted_n: float  #: uncompensated, later shifted to where it fits best
    shift_s: float
    looked_at_s: float  #: time in and around contacts
    without_force_s: float  #: of it, time in which no force is shown


def forces_of(course: Course, settings: ChainSettings) -> Forces:
    """The forces of a course by the bare law: a correction is left out."""
    pressed = course.contact > 0
    initial_kpa = course.initial_kpa[pressed]
    known = (initial_kpa >= VALID_LOW_KPA) & (initial_kpa <= VALID_HIGH_KPA)
    forces = []
    for pressure_kpa in (course.now_kpa, course.filtered_kpa):
        final_kpa = pressure_kpa[pressed]
        solved = estimate(initial_kpa, final_kpa, settings.balloon, settings.circuit, settings.law).force_n
        force_n = np.zeros(len(pressed))
        force_n[pressed] = np.where(known, solved, np.nan)
        forces.append(force_n)
    return Forces(course.trial, forces[0], forces[1], _around(pressed, course.trial.t_s))


def _around(pressed: Bools, t_s: Floats) -> Bools:
    """Where there is contact within `AROUND_S`."""
    pressed_s = t_s[pressed]
    if not len(pressed_s):
        return pressed
    after = np.searchsorted(pressed_s, t_s)
    next_s = pressed_s[np.minimum(after, len(pressed_s) - 1)]
    last_s = pressed_s[np.maximum(after - 1, 0)]
    return np.minimum(np.abs(next_s - t_s), np.abs(last_s - t_s)) <= AROUND_S


def continuous(forces: Sequence[Forces]) -> Continuous:
    """How well the forces follow the reference over all trials; NaN where there was no contact."""
    shifted = [_rmse_n(forces, shift_s) for shift_s in SHIFTS_S]
    best = int(np.argmin(shifted))
    looked_at_s = sum(float(part.trial.steps_s[part.near].sum()) for part in forces)
    without_s = sum(
        float(part.trial.steps_s[part.near & np.isnan(part.compensated_n)].sum()) for part in forces
    )
    gaps = [part.compensated_n - part.trial.force_n for part in forces]
    return Continuous(
        _root([gap[part.near] for gap, part in zip(gaps, forces, strict=True)]),
        shifted[0],
        shifted[best],
        float(SHIFTS_S[best]),
        looked_at_s,
        without_s,
    )


def _rmse_n(forces: Sequence[Forces], shift_s: float) -> float:
    """Of the uncompensated forces, shown `shift_s` earlier than they came [N]."""
    gaps = []
    for part in forces:
        t_s = part.trial.t_s[part.near]
        shown_n = np.interp(t_s + shift_s, part.trial.t_s, part.uncompensated_n)
        gaps.append(shown_n - part.trial.force_n[part.near])
    return _root(gaps)


def _root(gaps: Sequence[Floats]) -> float:
    """Root mean square of the gaps that are known; NaN without any."""
    gap = np.concatenate(gaps) if gaps else np.empty(0)
    known = gap[np.isfinite(gap)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
