"""The contacts of a course as the paper picks them: pressure before the peak and at it, and the true peak.

Section IV-B: ΔP_i is the lowest filtered pressure before the peak, ΔP_f the highest, the true force the peak
of the filtered reference. That there is a contact is what the instrument's own tracker says.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from instrument.chain import ChainSettings
from instrument.validation.course import Course
from instrument.validation.trial import Floats


class PickedContact(NamedTuple):
    """One contact, and when its two pressures were read."""

    initial_kpa: float  #: ΔP_i
    final_kpa: float  #: ΔP_f
    force_n: float  #: peak of the reference
    initial_s: float
    final_s: float


def contacts_of(course: Course, settings: ChainSettings) -> list[PickedContact]:
    """The contacts of one trial."""
    bounds = [*_troughs(course), len(course.trial.t_s)]
    return [_contact(course, trough, after, settings.tube_s) for trough, after in pairwise(bounds)]


def _troughs(course: Course) -> list[int]:
    """Index of the lowest filtered pressure between the tops of any two contacts, and before the first.

    Tops are taken from the unfiltered pressure: it has not yet turned where an overlapping contact is
    recognised, while the filtered one may still be falling, and that in the balloon is overshot in a jolt.
    """
    tops = [0, *(_highest(course.trial.pressure_kpa, at) for at in _stretches(course))]
    return [low + int(np.argmin(course.filtered_kpa[low : high + 1])) for low, high in pairwise(tops)]


def _stretches(course: Course) -> list[slice]:
    """The samples of each contact."""
    bounds = [0, *(np.flatnonzero(np.diff(course.contact)) + 1).tolist(), len(course.contact)]
    return [slice(low, high) for low, high in pairwise(bounds) if course.contact[low]]


def _highest(values: Floats, at: slice) -> int:
    return int(at.start + np.argmax(values[at]))


def _contact(course: Course, trough: int, after: int, tube_s: float) -> PickedContact:
    """The contact between two troughs; those of the reference, which comes without a tube, are earlier."""
    t_s, pressure_kpa = course.trial.t_s, course.filtered_kpa
    peak = _highest(pressure_kpa, slice(trough, after))
    end_s = t_s[after] if after < len(t_s) else np.inf
    first, last = np.searchsorted(t_s, [t_s[trough] - tube_s, end_s - tube_s])
    top_n = course.filtered_n[first : max(last, first + 1)].max()
    return PickedContact(
        float(pressure_kpa[trough]),
        float(pressure_kpa[peak]),
        float(top_n),
        float(t_s[trough]),
        float(t_s[peak]),
    )
