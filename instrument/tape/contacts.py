"""The contacts of a stream of measured samples: their pressures, their greatest force, and when.

What a contact is the instrument has decided (`instrument/contact.py`): here its samples come together again.
Two without a free sample between them are told apart by the rule from there.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

from instrument.contact import AT_REST_KPA, presses_again
from instrument.measurement import Quality
from instrument.rig.frames import BoardState
from instrument.rig.limits import HOST_SILENCE_S
from instrument.tape.measured import Measured

KEPT = 200
_UNREADABLE = Quality.SENSOR.value


class ContactRow(NamedTuple):
    """One contact; NaN where a quantity is not available."""

    number: int  #: from 1, as they came
    begin_s: float
    initial_kpa: float  #: ΔP_i, the baseline as the instrument takes it
    initial_s: float  #: when the pressure was last at rest, or at the trough after the contact before
    final_kpa: float  #: ΔP_f, the greatest pressure in the balloon
    final_s: float
    radius_mm: float  #: R_i
    peak_n: float  #: the greatest force
    peak_std_n: float  #: its standard uncertainty
    duration_s: float
    open: bool  #: still going on


@dataclass(slots=True)
class _Contact:
    number: int
    begin_s: float
    initial_kpa: float
    initial_s: float
    radius_mm: float
    final_kpa: float
    final_s: float
    trough_kpa: float
    trough_s: float
    peak_n: float = math.nan
    peak_std_n: float = math.nan
    last_s: float = math.nan

    def take(self, m: Measured, now_kpa: float) -> None:
        self.last_s = m.t_s
        if now_kpa > self.final_kpa:
            self.final_kpa = self.trough_kpa = now_kpa
            self.final_s = self.trough_s = m.t_s
        elif now_kpa < self.trough_kpa:
            self.trough_kpa, self.trough_s = now_kpa, m.t_s
        if m.force_n > self.peak_n or self.peak_n != self.peak_n:
            self.peak_n, self.peak_std_n = m.force_n, m.force_std_n

    def row(self, still: bool) -> ContactRow:
        return ContactRow(
            self.number,
            self.begin_s,
            self.initial_kpa,
            self.initial_s,
            self.final_kpa,
            self.final_s,
            self.radius_mm,
            self.peak_n,
            self.peak_std_n,
            self.last_s - self.begin_s,
            still,
        )


class Contacts:
    """Takes samples in order, and has the latest contacts; each sample costs the same."""

    def __init__(self, keep: int = KEPT) -> None:
        self._keep = keep
        self._ended: deque[ContactRow] = deque(maxlen=keep)
        self._open: _Contact | None = None
        self._count = 0
        self._last_s = self._rest_s = math.nan

    @property
    def rows(self) -> list[ContactRow]:
        """The latest contacts in order; one that goes on is as it stands now."""
        going_on = [self._open.row(still=True)] if self._open else []
        return [*self._ended, *going_on][-self._keep :]

    def take(self, m: Measured) -> bool:
        """Use one sample; whether a contact began or ended with it."""
        whole = 0 <= m.t_s - self._last_s <= HOST_SILENCE_S
        self._last_s = m.t_s
        if not whole:
            self._rest_s = math.nan
        ended = not whole and self._end()
        if m.in_contact:
            return self._pressed(m) or ended
        if m.quality & _UNREADABLE and m.state == BoardState.HOLDING:
            return ended  # such samples do not end a contact, as long as the board holds
        if m.pressure_kpa - m.initial_kpa < AT_REST_KPA:
            self._rest_s = m.t_s
        return self._end() or ended

    def _pressed(self, m: Measured) -> bool:
        now_kpa, contact = m.initial_kpa + m.rise_kpa, self._open
        if contact is None:
            rest_s = m.t_s if math.isnan(self._rest_s) else self._rest_s
            self._begin(m, now_kpa, m.initial_kpa, rest_s)
            return True
        contact.take(m, now_kpa)
        if not presses_again(now_kpa, m.initial_kpa, contact.final_kpa, contact.trough_kpa):
            return False
        self._end()
        self._begin(m, now_kpa, m.initial_kpa, contact.trough_s)
        return True

    def _begin(self, m: Measured, now_kpa: float, initial_kpa: float, initial_s: float) -> None:
        self._count += 1
        at_s, radius_mm = m.t_s, m.radius_mm
        self._open = _Contact(
            self._count, at_s, initial_kpa, initial_s, radius_mm, now_kpa, at_s, now_kpa, at_s
        )
        self._open.take(m, now_kpa)

    def _end(self) -> bool:
        contact, self._open = self._open, None
        if contact is not None:
            self._ended.append(contact.row(still=False))
            self._rest_s = math.nan
        return contact is not None
