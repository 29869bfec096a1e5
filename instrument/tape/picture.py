"""What a picture of a recording shows, put together sample by sample however long the recording is."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from instrument.faults import name_of
from instrument.rig.limits import HOST_SILENCE_S, PRESSURISED
from instrument.tape.contacts import ContactRow, Contacts
from instrument.tape.measured import Measured
from instrument.tape.strand import Strand

MOST_CONTACTS = 20_000
VENTED, SILENT = "vented", "no samples"
Points = NDArray[np.float64]
_FILLED = frozenset(state.value for state in PRESSURISED)


class Span(NamedTuple):
    """A time in which there was nothing to measure, and why."""

    begin_s: float
    end_s: float
    name: str
    trip: bool


class Picture:
    """Takes measured samples in order, and what the event log says of faults in between."""

    def __init__(self, begin_s: float) -> None:
        """Times are shown since `begin_s`, the beginning of the recording."""
        self.begin_s = begin_s
        self.first_s = self.end_s = math.nan  #: of what was taken
        self.samples = 0
        self.filled = False  #: whether the balloon was, at any time
        self.pressure, self.pressed, self.setpoint, self.force = Strand(), Strand(), Strand(), Strand()
        self._contacts = Contacts(keep=MOST_CONTACTS)
        self.spans: list[Span] = []  #: when there was nothing to measure, in order
        self._latched: tuple[str, ...] = ()

    def latched(self, faults: tuple[str, ...]) -> None:
        """From now on these faults are latched, the first one first."""
        self._latched = faults

    def take(self, m: Measured) -> None:
        """Use one sample."""
        if not self.samples:
            self.first_s = m.t_s
        elif not 0 <= m.t_s - self.end_s <= HOST_SILENCE_S:
            self.spans.append(Span(self.end_s, m.t_s, SILENT, trip=False))
        self._contacts.take(m)
        self._rest(m)
        self.pressure.take(m.t_s, m.pressure_kpa)
        self.pressed.take(m.t_s, m.initial_kpa + m.rise_kpa if m.in_contact else math.nan)
        self.setpoint.take(m.t_s, m.setpoint_pa / 1e3 if m.setpoint_pa else math.nan)
        self.force.take(m.t_s, m.force_n, m.force_std_n if m.in_contact else 0.0)
        self.samples += 1
        self.end_s = m.t_s

    def _rest(self, m: Measured) -> None:
        if m.state in _FILLED:
            self.filled = True
            return
        names = (name_of(m.fault),) if m.fault else self._latched
        name, last = (names or (VENTED,))[0], self.spans[-1] if self.spans else None
        if last is not None and last.end_s == self.end_s and last.name == name:
            self.spans[-1] = last._replace(end_s=m.t_s)
        else:
            self.spans.append(Span(m.t_s, m.t_s, name, trip=bool(names)))

    def points(self, strand: Strand) -> Points:
        """A curve as rows of time, value and uncertainty, interrupted where there were no samples."""
        points = strand.points()
        silences = [span for span in self.spans if span.name == SILENT]
        where = np.searchsorted(points[:, 0], [span.begin_s for span in silences], side="right")
        breaks = np.array([(span.end_s, math.nan, math.nan) for span in silences], float).reshape(-1, 3)
        return np.insert(points, where, breaks, axis=0)

    @property
    def contacts(self) -> list[ContactRow]:
        """The contacts in order."""
        return self._contacts.rows

    @property
    def remark(self) -> str:
        """What a reader must know of it in a sentence, empty where nothing is missing."""
        if not self.samples:
            return "no samples"
        if not self.filled:
            return "vented all the time: no force"
        if not self.contacts:
            return "no contact"
        return "" if any(row.peak_n == row.peak_n for row in self.contacts) else "no force in any contact"
