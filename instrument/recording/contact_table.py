"""Contacts of a recording as a table: one row per contact, with its force, its end and its limitations."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple, get_type_hints

from pneuforce.instrument.measurement.measurement import Quality
from pneuforce.instrument.recording.contacts import ContactHistory, ContactRow
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.protocol.frames import BoardState
from pneuforce.protocol.limits import HELD, HOST_SILENCE_S

ENDED, CUT, OPEN = "ended", "cut", "open"
VENTED, TRIPPED, INTERRUPTED = "vented", "tripped", "interrupted"


class RecordedContact(NamedTuple):
    """One contact. A quantity that is not available is NaN. Times count as in the samples."""

    number: int  #: number of the contact, counted from 1
    begin_s: float
    end_s: float  #: time of the last sample of the contact
    duration_s: float
    baseline_kpa: float  #: ΔP_i
    final_kpa: float  #: ΔP_f at the highest peak
    final_s: float  #: time of the highest peak
    force_n: float  #: force of the highest peak, which follows from `baseline_kpa` and `final_kpa`
    force_std_n: float  #: standard uncertainty of `force_n`
    peaks: int  #: number of peaks; a very short contact may have none
    #: "ended" if the contact is complete; "cut" if its beginning is missing; "open" at the end of the
    #: samples; "vented", "tripped" or "interrupted" (missing samples) if the contact did not end by itself
    state: str
    #: reasons why the contact has no force, separated by spaces; "" if it has a force
    reason: str
    touch_only: bool  #: True if the force is below the lower limit of measurement, and so no measurement


CONTACT_TYPES: Mapping[str, type] = get_type_hints(RecordedContact)


class ContactCollector:
    """All contacts of a stream of samples."""

    def __init__(self, tube_time_constant_s: float) -> None:
        self._history = ContactHistory(sys.maxsize, tube_time_constant_s)
        self._quality: dict[int, int] = {}
        self._states: dict[int, str] = {}
        self._last_s = math.nan

    def add_sample(self, m: SampleRecord) -> None:
        """Add one sample."""
        before = self._history.open_number
        self._history.add_sample(m)
        number = self._history.open_number
        if before is not None and number != before:
            self._states[before] = _end_state(m, m.t_s - self._last_s)
        if number is not None:
            self._quality[number] = self._quality.get(number, 0) | m.quality
        self._last_s = m.t_s

    def contacts(self) -> list[RecordedContact]:
        """Return all contacts in order of time."""
        return [self._contact(row) for row in self._history.rows]

    def _contact(self, row: ContactRow) -> RecordedContact:
        """Return the contact. A reason removes its force, because the true highest force is then unknown."""
        reason = _reason(Quality(self._quality[row.number]), row.peak_n)
        return RecordedContact(
            number=row.number,
            begin_s=row.begin_s,
            end_s=row.begin_s + row.duration_s,
            duration_s=row.duration_s,
            baseline_kpa=row.baseline_kpa,
            final_kpa=row.final_kpa,
            final_s=row.final_s,
            force_n=math.nan if reason else row.peak_n,
            force_std_n=math.nan if reason else row.peak_std_n,
            peaks=row.peaks,
            state=CUT if row.cut else OPEN if row.open else self._states[row.number],
            reason=reason,
            touch_only=not reason and row.peak_n < row.force_lower_range_limit_n,
        )


def collect_contacts(samples: Iterable[SampleRecord], tube_time_constant_s: float) -> list[RecordedContact]:
    """Return all contacts in the samples, in order of time."""
    collector = ContactCollector(tube_time_constant_s)
    for m in samples:
        collector.add_sample(m)
    return collector.contacts()


def relative_contacts(begin_s: float, contacts: Iterable[RecordedContact]) -> Iterator[RecordedContact]:
    """Yield the contacts with times since `begin_s` [s], rounded to the microsecond."""
    for contact in contacts:
        # The sum with 0.0 makes 0.0 of -0.0.
        times = {
            name: round(getattr(contact, name) - begin_s, 6) + 0.0 for name in ("begin_s", "end_s", "final_s")
        }
        yield contact._replace(**times, duration_s=round(contact.duration_s, 6))


def _end_state(m: SampleRecord, gap_s: float) -> str:
    """Return how a contact ended. `m` is the first sample after the contact, `gap_s` the time before it."""
    if not 0 <= gap_s <= HOST_SILENCE_S:
        return INTERRUPTED
    if m.state == BoardState.TRIPPED:
        return TRIPPED
    return ENDED if m.state in HELD else VENTED


def _reason(quality: Quality, force_n: float) -> str:
    """Return the names of the reasons why a force of the contact is missing.

    A rise below 0.5 kPa is a part of each contact. It is no reason if there is a force or another reason.
    """
    if math.isfinite(force_n) or quality != Quality.INTERPOLATED:
        quality &= ~Quality.INTERPOLATED
    return " ".join(flag.name.lower() for flag in Quality if flag in quality and flag.name)
