"""Data of the plot of a recording, collected sample by sample in constant memory."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneuforce.instrument.core.faults import described
from pneuforce.instrument.recording.contacts import (
    DEFAULT_TUBE_TIME_CONSTANT_S,
    ContactHistory,
    ContactRow,
)
from pneuforce.instrument.recording.decimation import MinMaxDecimator
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.protocol.limits import HOST_SILENCE_S, PRESSURISED

MAX_CONTACTS = 20_000
MAX_SPANS = 1000  #: later spans are not drawn; a note in the plot says so
#: Largest absolute value that is drawn [kPa, mm, N]. No instrument measures a larger value. Sums and products
#: of smaller values are finite.
MAX_DRAWN = 1e6
VENTED, NO_SAMPLES = "vented", "no samples"
Points = NDArray[np.float64]
_PRESSURISED = frozenset(state.value for state in PRESSURISED)


_FIRST = SampleRecord._fields.index("pressure_kpa")
_END = SampleRecord._fields.index("force_lower_range_limit_n") + 1


def drawable(m: SampleRecord) -> SampleRecord:
    """Return the sample with NaN for each measured value that is infinite or too large to be drawn."""
    if not any(abs(value) > MAX_DRAWN for value in m[_FIRST:_END]):
        return m
    values = list(m)
    values[_FIRST:_END] = [math.nan if abs(value) > MAX_DRAWN else value for value in m[_FIRST:_END]]
    return SampleRecord._make(values)


class UnmeasuredSpan(NamedTuple):
    """Time span in which the balloon was vented or no samples were recorded."""

    begin_s: float
    end_s: float
    name: str
    trip: bool


class PlotData:
    """Collector of samples and latched faults, in order of time, for one plot."""

    def __init__(self, begin_s: float, tube_time_constant_s: float = DEFAULT_TUBE_TIME_CONSTANT_S) -> None:
        """Create an empty plot. `begin_s` is the time at which the recording begins."""
        self.begin_s = begin_s
        self.first_s = self.end_s = math.nan  #: times of the first and of the last sample
        self.samples = 0
        self.was_pressurised = False  #: True if the balloon was pressurised at any time
        self.pressure = MinMaxDecimator()
        self.contact_pressure = MinMaxDecimator()
        self.setpoint = MinMaxDecimator()
        self.force = MinMaxDecimator()
        self._contacts = ContactHistory(MAX_CONTACTS, tube_time_constant_s)
        self.spans: list[UnmeasuredSpan] = []  #: first spans without a force, in order of time
        self.has_more_spans = False  #: True if there are more than `MAX_SPANS` spans
        self._latched: tuple[str, ...] = ()

    def set_latched_faults(self, faults: tuple[str, ...]) -> None:
        """Set the faults that are latched from now on, first-out fault first."""
        self._latched = faults

    def add_sample(self, m: SampleRecord) -> None:
        """Add one sample."""
        m = drawable(m)
        if not self.samples:
            self.first_s = m.t_s
        elif not 0 <= m.t_s - self.end_s <= HOST_SILENCE_S:
            self._add_span(UnmeasuredSpan(self.end_s, m.t_s, NO_SAMPLES, trip=False))
        self._contacts.add_sample(m)
        self._update_spans(m)
        contact_kpa = m.baseline_kpa + m.rise_kpa if m.in_contact else math.nan
        self.pressure.add(m.t_s, m.pressure_kpa)
        self.contact_pressure.add(m.t_s, contact_kpa)
        self.setpoint.add(m.t_s, m.setpoint_pa / 1e3 if m.setpoint_pa else math.nan)
        self.force.add(m.t_s, m.force_n, m.force_std_n if m.in_contact else 0.0)
        self.samples += 1
        self.end_s = m.t_s

    def _update_spans(self, m: SampleRecord) -> None:
        if m.state in _PRESSURISED:
            self.was_pressurised = True
            return
        names = (described(m.fault),) if m.fault else self._latched
        name, last = (names or (VENTED,))[0], self.spans[-1] if self.spans else None
        if last is not None and last.end_s == self.end_s and last.name == name:
            self.spans[-1] = last._replace(end_s=m.t_s)
        else:
            self._add_span(UnmeasuredSpan(m.t_s, m.t_s, name, trip=bool(names)))

    def _add_span(self, span: UnmeasuredSpan) -> None:
        if len(self.spans) < MAX_SPANS:
            self.spans.append(span)
        else:
            self.has_more_spans = True

    def points(self, decimator: MinMaxDecimator) -> Points:
        """Return the points of a curve, shape (n, 3): time, value and uncertainty.

        A NaN value interrupts the curve between two samples that are more than HOST_SILENCE_S apart.
        """
        points = decimator.points()
        silences = [span for span in self.spans if span.name == NO_SAMPLES]
        where = np.searchsorted(points[:, 0], [span.begin_s for span in silences], side="right")
        breaks = np.array([(span.end_s, math.nan, math.nan) for span in silences], float).reshape(-1, 3)
        return np.insert(points, where, breaks, axis=0)

    @property
    def contacts(self) -> list[ContactRow]:
        """Return the contacts in order of time."""
        return self._contacts.rows

    @property
    def remark(self) -> str:
        """Return the reason why no contact has a force, or an empty string if a contact has a force."""
        if not self.was_pressurised:
            return "vented all the time: no force"
        if not self.contacts:
            return "no contact"
        return "" if any(not math.isnan(row.peak_n) for row in self.contacts) else "no force in any contact"
