"""Contacts in a stream of measured samples: pressures, peaks of the force and times of each contact.

The instrument decides when a sample belongs to a contact (`instrument/measurement/contact.py`). This module
groups these samples into contacts. If no free sample lies between two contacts, `ContactExtremes` separates
them, as in the instrument. The peaks are those of the instrument, because `PeakTracker` finds both.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.contact import AT_REST_KPA
from pneuforce.instrument.measurement.contact_extremes import ContactExtremes
from pneuforce.instrument.measurement.lag import SMOOTHING_TIME_CONSTANT_S
from pneuforce.instrument.measurement.measurement import Quality
from pneuforce.instrument.measurement.peak import Peak, PeakTracker
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.protocol.frames import BoardState
from pneuforce.protocol.limits import HOST_SILENCE_S

DEFAULT_CAPACITY = 200
MAX_TUBE_TIME_CONSTANT_S = 1.0  #: a larger value in the header of a recording is not that of a tube
DEFAULT_TUBE_TIME_CONSTANT_S = ChainSettings().tube_time_constant_s
#: A contact that is detected within this number of samples after a gap or a proof test has begun before. If a
#: contact begins after them, its pressure rises first, and it is detected later.
DETECTION_SAMPLES = 5
_SENSOR_FAULT, _TESTING = Quality.SENSOR_FAULT.value, Quality.TESTING.value


class ContactRow(NamedTuple):
    """One contact. A quantity that is not available is NaN."""

    number: int  #: number of the contact, counted from 1
    begin_s: float
    baseline_kpa: float  #: ΔP_i, as the instrument determined it
    initial_s: float  #: time of the last sample at rest, or of the trough after the previous contact
    final_kpa: float  #: ΔP_f at the highest peak, which gives the force `peak_n`
    final_s: float  #: time of `final_kpa`
    radius_mm: float  #: R_i
    peak_n: float  #: force of the highest peak; if there is no peak, of the sample with the greatest force
    peak_std_n: float  #: standard uncertainty of `peak_n`
    force_lower_range_limit_n: float  #: a smaller `peak_n` shows only that there was a contact
    peaks: int  #: number of peaks; the peak in progress counts, and a very short contact may have none
    duration_s: float
    open: bool  #: True if the contact has not ended
    cut: bool  #: True if the beginning is missing: before the first sample, in a gap or in a proof test
    interrupted: bool = False  #: True if the end is missing, because it is in a gap


@dataclass(slots=True)
class _OpenContact:
    number: int
    begin_s: float
    baseline_kpa: float
    initial_s: float
    radius_mm: float
    force_lower_range_limit_n: float
    peak: Peak  # highest peak, or the sample with the greatest force if there is no peak
    extremes: ContactExtremes
    trough_s: float  # time of the lowest pressure since the highest
    cut: bool
    peaks: int = 0
    last_s: float = math.nan

    def add_sample(self, m: SampleRecord, smoothed_kpa: float) -> bool:
        """Add one sample. Return True if a new contact begins with it."""
        self.last_s, now_kpa = m.t_s, m.baseline_kpa + m.rise_kpa
        is_new = self.extremes.step(now_kpa, smoothed_kpa, m.baseline_kpa)
        if now_kpa == self.extremes.trough_kpa:
            self.trough_s = m.t_s
        if not self.peaks:
            self.peak = max(self.peak, _sample_peak(m), key=_height)
        return is_new

    def add_peak(self, peak: Peak) -> None:
        self.peak = max(self.peak, peak, key=_height) if self.peaks else peak
        self.peaks += 1

    def row(self, still_open: bool, interrupted: bool = False) -> ContactRow:
        return ContactRow(
            self.number,
            self.begin_s,
            self.baseline_kpa,
            self.initial_s,
            self.baseline_kpa + self.peak.rise_kpa,
            self.peak.t_s,
            self.radius_mm,
            self.peak.force_n,
            self.peak.force_std_n,
            self.force_lower_range_limit_n,
            self.peaks,
            self.last_s - self.begin_s,
            still_open,
            self.cut,
            interrupted,
        )


def _sample_peak(m: SampleRecord) -> Peak:
    return Peak(m.t_s, m.rise_kpa, m.force_n, m.force_std_n)


def _height(peak: Peak) -> float:
    """Return the key that compares peaks: the rise. A peak without a force can be the highest peak."""
    return -math.inf if math.isnan(peak.rise_kpa) else peak.rise_kpa


def tube_time_constant_of(header: Mapping[str, Any]) -> float:
    """Return the time constant [s] in the header of a stream, or the default if it is invalid."""
    value = header.get("tube_time_constant_s")
    if isinstance(value, float | int) and 0 <= value <= MAX_TUBE_TIME_CONSTANT_S:
        return float(value)
    return DEFAULT_TUBE_TIME_CONSTANT_S


def with_peak(row: ContactRow, peak: Peak) -> ContactRow:
    """Return the row with one more peak. The highest peak determines force, ΔP_f and their time."""
    before = Peak(row.final_s, row.final_kpa - row.baseline_kpa, row.peak_n, row.peak_std_n)
    if row.peaks and _height(before) >= _height(peak):
        return row._replace(peaks=row.peaks + 1)
    return row._replace(
        final_kpa=row.baseline_kpa + peak.rise_kpa,
        final_s=peak.t_s,
        peak_n=peak.force_n,
        peak_std_n=peak.force_std_n,
        peaks=row.peaks + 1,
    )


class ContactHistory:
    """Latest contacts of a stream of samples. The processing time per sample is constant."""

    def __init__(
        self,
        capacity: int = DEFAULT_CAPACITY,
        tube_time_constant_s: float = DEFAULT_TUBE_TIME_CONSTANT_S,
    ) -> None:
        """Create an empty history. The stream header contains `tube_time_constant_s`."""
        self._capacity = capacity
        self._peaks = PeakTracker(tube_time_constant_s)
        self._ended: deque[ContactRow] = deque(maxlen=capacity)
        self._open: _OpenContact | None = None
        self._count = 0
        self._last_s = self._rest_s = self._smoothed_kpa = math.nan
        self._complete_count = 0  # samples since the first sample, the last gap or the last proof test

    @property
    def rows(self) -> list[ContactRow]:
        """Return the latest contacts, the oldest first. A contact that has not ended is last."""
        rows, highest = list(self._ended), self._peaks.highest
        if self._open is not None:
            rows.append(self._open.row(still_open=True))
        if highest is not None and rows:
            index = self._index_of(highest)
            rows[index] = with_peak(rows[index], highest)
        return rows[-self._capacity :]

    @property
    def open_number(self) -> int | None:
        """Return the number of the contact in progress, or None."""
        return None if self._open is None else self._open.number

    def add_sample(self, m: SampleRecord) -> bool:
        """Add one sample. Return True if a contact began or ended, or if a peak is complete."""
        dt_s = m.t_s - self._last_s
        continuous = 0 <= dt_s <= HOST_SILENCE_S
        self._last_s = m.t_s
        if not continuous:
            self._rest_s = math.nan
        missing = not continuous or m.quality & _TESTING
        self._complete_count = 0 if missing else self._complete_count + 1
        self._smooth(m.unfiltered_kpa, dt_s, continuous)
        peaks = self._peaks.step(m)
        for peak in peaks:
            self._add_peak(peak)
        ended = (not continuous and self._end(interrupted=True)) or bool(peaks)
        if m.in_contact:
            return self._add_contact_sample(m) or ended
        if m.quality & _SENSOR_FAULT and m.state == BoardState.HOLDING:
            return ended  # an invalid sample does not end a contact while the board holds the pressure
        if m.pressure_kpa - m.baseline_kpa < AT_REST_KPA:
            self._rest_s = m.t_s
        return self._end() or ended

    def _add_contact_sample(self, m: SampleRecord) -> bool:
        contact = self._open
        if contact is None:
            self._begin(m, m.t_s if math.isnan(self._rest_s) else self._rest_s)
            return True
        if not contact.add_sample(m, self._smoothed_kpa):
            return False
        self._end()
        self._begin(m, contact.trough_s)
        return True

    def _smooth(self, unfiltered_kpa: float, dt_s: float, continuous: bool) -> None:
        """Smooth the reading as `LagCompensator` does. Restart after a gap."""
        if continuous and math.isfinite(self._smoothed_kpa):
            if math.isfinite(unfiltered_kpa):
                share = min(dt_s / SMOOTHING_TIME_CONSTANT_S, 1.0)
                self._smoothed_kpa += share * (unfiltered_kpa - self._smoothed_kpa)
        else:
            self._smoothed_kpa = unfiltered_kpa

    def _add_peak(self, peak: Peak) -> None:
        contact = self._open
        if contact is None or self._index_of(peak) < -1:
            self._ended[-1] = with_peak(self._ended[-1], peak)
        else:
            contact.add_peak(peak)

    def _index_of(self, peak: Peak) -> int:
        """Return the index of the contact of a peak: -1 for the latest contact, -2 for the contact before it.

        A peak can be complete when the next contact has begun.
        """
        return -2 if self._open is not None and self._ended and peak.t_s < self._open.initial_s else -1

    def _begin(self, m: SampleRecord, initial_s: float) -> None:
        self._count += 1
        extremes = ContactExtremes.start(m.baseline_kpa + m.rise_kpa, self._smoothed_kpa)
        self._open = _OpenContact(
            self._count,
            m.t_s,
            m.baseline_kpa,
            initial_s,
            m.radius_mm,
            m.force_lower_range_limit_n,
            _sample_peak(m),
            extremes,
            m.t_s,
            self._complete_count < DETECTION_SAMPLES,
            last_s=m.t_s,
        )

    def _end(self, interrupted: bool = False) -> bool:
        contact, self._open = self._open, None
        if contact is not None:
            self._ended.append(contact.row(still_open=False, interrupted=interrupted))
            self._rest_s = math.nan
        return contact is not None
