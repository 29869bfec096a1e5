"""Contacts of a recording, paired with a reference force: the plateau of each contact for a calibration."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from pneuforce.instrument.calibration.contacts import MAX_FORCE_N
from pneuforce.instrument.measurement.contact import ONSET_KPA
from pneuforce.instrument.measurement.measurement import Quality
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.recording.contact_table import ContactCollector, RecordedContact
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.instrument.validation.clock_offset import Signal
from pneuforce.instrument.validation.reference import force_at
from pneuforce.instrument.validation.trial import MIN_FORCE_N, Floats
from pneuforce.support.columns import Points

#: Duration of a plateau, and time between the beginnings of two plateaus that are compared.
PLATEAU_S, STEP_S = 0.5, 0.05
#: Time after the start of a contact that no plateau contains, because lag compensation and gas settle.
SETTLING_S = 0.2
#: The force of a plateau is constant if its standard deviation is below this share, or below this force.
MAX_VARIATION, MAX_VARIATION_N = 0.03, 0.02
#: The pressure of a plateau is constant if the standard deviation of the rise is below this share, or below
#: this pressure, which is above the noise of the lag compensation.
MAX_RISE_VARIATION, MAX_RISE_VARIATION_KPA = 0.05, 0.03
#: A plateau has at least this share of the highest force of the contact.
MIN_FORCE_SHARE = 0.5


class PairedContact(NamedTuple):
    """Plateau of one contact: mean pressures, and mean reference force with its standard uncertainty."""

    baseline_kpa: float
    final_kpa: float
    force_n: float
    force_std_n: float  #: standard deviation of the reference readings in the plateau
    contact: int  #: number of the contact in the recording
    plateau_begin_s: float  #: time of the start of the plateau


class UnpairedContact(NamedTuple):
    """Contact without a usable plateau."""

    contact: int  #: number of the contact in the recording
    begin_s: float
    reason: str


class PressureCourse:
    """Pressures of the samples in a recording, and the contacts in these samples."""

    def __init__(self, tube_time_constant_s: float) -> None:
        self._collector = ContactCollector(tube_time_constant_s)
        self._columns = [array("d") for _ in range(4)]
        self.contacts: list[RecordedContact] = []
        self.t_s = self.baseline_kpa = self.rise_kpa = self.quality = np.empty(0)

    def add_samples(self, samples: Iterable[SampleRecord]) -> None:
        """Add all samples. Afterwards, the contacts and the arrays are available."""
        for m in samples:
            self._collector.add_sample(m)
            rise_kpa = m.rise_kpa if m.in_contact else math.nan
            for column, value in zip(
                self._columns, (m.t_s, m.baseline_kpa, rise_kpa, m.quality), strict=True
            ):
                column.append(value)
        self.t_s, self.baseline_kpa, self.rise_kpa, self.quality = map(np.array, self._columns)
        self.contacts = self._collector.contacts()

    def select(self, from_s: float, to_s: float) -> None:
        """Keep only the contacts between two times since the beginning of the recording [s]."""
        self.contacts = [
            contact for contact in self.contacts if from_s <= contact.begin_s and contact.end_s <= to_s
        ]

    @property
    def signal(self) -> Signal:
        """Return the pressure rise over time, 0 without contact."""
        rising = np.flatnonzero(np.diff(self.t_s, prepend=-np.inf) > 0)
        return Signal(self.t_s[rising], np.nan_to_num(self.rise_kpa[rising]))

    def free_force_n(self, reference: Signal) -> float:
        """Return the median of the reference force while the balloon has no contact; NaN without readings."""
        if not len(self.t_s):
            return math.nan
        at = np.clip(np.searchsorted(self.t_s, reference.t_s), 0, len(self.t_s) - 1)
        inside = (reference.t_s >= self.t_s[0]) & (reference.t_s <= self.t_s[-1])
        free = inside & np.isnan(self.rise_kpa[at])
        return float(np.median(reference.value[free])) if free.any() else math.nan


def pair_reference(
    course: PressureCourse, reference: Points
) -> tuple[list[PairedContact], list[UnpairedContact]]:
    """Return the plateau of each contact, and the contacts without a plateau with the reason.

    The times of the reference are those of the recording.
    """
    paired, unpaired = [], []
    for contact in course.contacts:
        plateau = _plateau(course, contact, reference)
        if isinstance(plateau, str):
            unpaired.append(UnpairedContact(contact.number, contact.begin_s, plateau))
        else:
            paired.append(plateau)
    return paired, unpaired


def _plateau(course: PressureCourse, contact: RecordedContact, reference: Points) -> PairedContact | str:
    """Return the plateau with the smallest variation, or the reason why there is none."""
    if contact.duration_s < SETTLING_S + PLATEAU_S:
        return f"the contact is shorter than {SETTLING_S + PLATEAU_S:g} s"
    begins_s = np.arange(contact.begin_s + SETTLING_S, contact.end_s - PLATEAU_S + 1e-9, STEP_S)
    plateaus = [_plateau_at(course, contact.number, float(begin_s), reference) for begin_s in begins_s]
    measured = [plateau for plateau in plateaus if plateau is not None]
    if not measured:
        return f"the reference has no readings for {PLATEAU_S:g} s of the contact"
    lowest_n = MIN_FORCE_SHARE * max(plateau.force_n for plateau in measured)
    pressed = [plateau for plateau in measured if plateau.force_n >= lowest_n] or measured
    best = min(pressed, key=lambda plateau: plateau.force_std_n / max(plateau.force_n, MIN_FORCE_N))
    return _problem(best, course) or best


def _plateau_at(
    course: PressureCourse, number: int, begin_s: float, reference: Points
) -> PairedContact | None:
    """Return the means over one plateau, None if the reference or the pressure has a gap."""
    span = slice(*np.searchsorted(course.t_s, [begin_s, begin_s + PLATEAU_S]))
    force_n = force_at(course.t_s[span], reference)
    baseline_kpa, rise_kpa = course.baseline_kpa[span], course.rise_kpa[span]
    if not len(force_n) or not np.isfinite(force_n + baseline_kpa + rise_kpa).all():
        return None
    readings = _readings(reference, begin_s)
    return PairedContact(
        float(baseline_kpa.mean()),
        float((baseline_kpa + rise_kpa).mean()),
        float(force_n.mean()),
        float(readings.std(ddof=1)) if len(readings) > 1 else 0.0,
        number,
        begin_s,
    )


def _readings(reference: Points, begin_s: float) -> Floats:
    first, last = np.searchsorted(reference["t_s"], [begin_s, begin_s + PLATEAU_S])
    return reference["force_n"][first:last]


def _problem(plateau: PairedContact, course: PressureCourse) -> str:
    """Return the reason why a plateau cannot be used for a calibration; "" if it can."""
    first, last = np.searchsorted(course.t_s, [plateau.plateau_begin_s, plateau.plateau_begin_s + PLATEAU_S])
    unknown = Quality.NO_BASELINE | Quality.NOT_ZEROED | Quality.SENSOR_FAULT
    if (course.quality[first:last].astype(int) & unknown.value).any():
        return "ΔP_i is not known"
    if not VALID_LOW_KPA <= plateau.baseline_kpa <= VALID_HIGH_KPA:
        return f"ΔP_i = {plateau.baseline_kpa:.2f} kPa is outside {VALID_LOW_KPA} to {VALID_HIGH_KPA} kPa"
    if not plateau.final_kpa - plateau.baseline_kpa >= ONSET_KPA:
        return f"the pressure rise of the plateau is below {ONSET_KPA:g} kPa"
    if not MIN_FORCE_N <= plateau.force_n <= MAX_FORCE_N:
        return (
            f"the reference force of {plateau.force_n:.3f} N is not within {MIN_FORCE_N} to {MAX_FORCE_N:g} N"
        )
    if not plateau.force_std_n <= max(MAX_VARIATION * plateau.force_n, MAX_VARIATION_N):
        return f"the force was not constant for {PLATEAU_S:g} s: it varies by {plateau.force_std_n:.3f} N"
    rise_kpa = course.rise_kpa[first:last]
    if not rise_kpa.std() <= max(MAX_RISE_VARIATION * rise_kpa.mean(), MAX_RISE_VARIATION_KPA):
        return "the pressure was not constant while the force was constant: check the clock offset"
    return ""
