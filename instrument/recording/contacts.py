"""Contacts in a stream of measured samples: pressures, greatest force and times of each contact.

The instrument decides when a sample belongs to a contact (`instrument/measurement/contact.py`). This module
groups these samples into contacts. If no free sample lies between two contacts, `is_new_contact` of that
module separates them.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

from pneuforce.instrument.measurement.contact import AT_REST_KPA, is_new_contact
from pneuforce.instrument.measurement.measurement import Quality
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.protocol.frames import BoardState
from pneuforce.protocol.limits import HOST_SILENCE_S

DEFAULT_CAPACITY = 200
_SENSOR_FAULT = Quality.SENSOR_FAULT.value


class ContactRow(NamedTuple):
    """One contact. A quantity that is not available is NaN."""

    number: int  #: number of the contact, counted from 1
    begin_s: float
    baseline_kpa: float  #: ΔP_i, as the instrument determined it
    initial_s: float  #: time of the last sample at rest, or of the trough after the previous contact
    final_kpa: float  #: ΔP_f, the greatest pressure in the balloon
    final_s: float
    radius_mm: float  #: R_i
    peak_n: float  #: the greatest force
    peak_std_n: float  #: standard uncertainty of the greatest force
    duration_s: float
    open: bool  #: True if the contact has not ended


@dataclass(slots=True)
class _OpenContact:
    number: int
    begin_s: float
    baseline_kpa: float
    initial_s: float
    radius_mm: float
    final_kpa: float
    final_s: float
    trough_kpa: float
    trough_s: float
    peak_n: float = math.nan
    peak_std_n: float = math.nan
    last_s: float = math.nan

    def add_sample(self, m: SampleRecord, now_kpa: float) -> None:
        self.last_s = m.t_s
        if now_kpa > self.final_kpa:
            self.final_kpa = self.trough_kpa = now_kpa
            self.final_s = self.trough_s = m.t_s
        elif now_kpa < self.trough_kpa:
            self.trough_kpa, self.trough_s = now_kpa, m.t_s
        if m.force_n > self.peak_n or math.isnan(self.peak_n):
            self.peak_n, self.peak_std_n = m.force_n, m.force_std_n

    def row(self, still_open: bool) -> ContactRow:
        return ContactRow(
            self.number,
            self.begin_s,
            self.baseline_kpa,
            self.initial_s,
            self.final_kpa,
            self.final_s,
            self.radius_mm,
            self.peak_n,
            self.peak_std_n,
            self.last_s - self.begin_s,
            still_open,
        )


class ContactHistory:
    """Latest contacts of a stream of samples. The processing time per sample is constant."""

    def __init__(self, capacity: int = DEFAULT_CAPACITY) -> None:
        self._capacity = capacity
        self._ended: deque[ContactRow] = deque(maxlen=capacity)
        self._open: _OpenContact | None = None
        self._count = 0
        self._last_s = self._rest_s = math.nan

    @property
    def rows(self) -> list[ContactRow]:
        """Return the latest contacts, the oldest first. A contact that has not ended is last."""
        still_open = [self._open.row(still_open=True)] if self._open else []
        return [*self._ended, *still_open][-self._capacity :]

    def add_sample(self, m: SampleRecord) -> bool:
        """Add one sample. Return True if a contact began or ended with this sample."""
        continuous = 0 <= m.t_s - self._last_s <= HOST_SILENCE_S
        self._last_s = m.t_s
        if not continuous:
            self._rest_s = math.nan
        ended = not continuous and self._end()
        if m.in_contact:
            return self._add_contact_sample(m) or ended
        if m.quality & _SENSOR_FAULT and m.state == BoardState.HOLDING:
            return ended  # an invalid sample does not end a contact while the board holds the pressure
        if m.pressure_kpa - m.baseline_kpa < AT_REST_KPA:
            self._rest_s = m.t_s
        return self._end() or ended

    def _add_contact_sample(self, m: SampleRecord) -> bool:
        now_kpa, contact = m.baseline_kpa + m.rise_kpa, self._open
        if contact is None:
            rest_s = m.t_s if math.isnan(self._rest_s) else self._rest_s
            self._begin(m, now_kpa, m.baseline_kpa, rest_s)
            return True
        contact.add_sample(m, now_kpa)
        if not is_new_contact(now_kpa, m.baseline_kpa, contact.final_kpa, contact.trough_kpa):
            return False
        self._end()
        self._begin(m, now_kpa, m.baseline_kpa, contact.trough_s)
        return True

    def _begin(self, m: SampleRecord, now_kpa: float, baseline_kpa: float, initial_s: float) -> None:
        self._count += 1
        at_s, radius_mm = m.t_s, m.radius_mm
        self._open = _OpenContact(
            self._count, at_s, baseline_kpa, initial_s, radius_mm, now_kpa, at_s, now_kpa, at_s
        )
        self._open.add_sample(m, now_kpa)

    def _end(self) -> bool:
        contact, self._open = self._open, None
        if contact is not None:
            self._ended.append(contact.row(still_open=False))
            self._rest_s = math.nan
        return contact is not None
