"""Reference force on the clock of a recording: clock offset, and reading of the unloaded reference sensor."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.validation.clock_offset import (
    ClockOffset,
    Signal,
    correlation_at,
    estimate_offset,
)
from pneuforce.instrument.validation.clock_rate import rate_warning
from pneuforce.instrument.validation.reference import ReferenceColumns, shifted
from pneuforce.instrument.validation.reference_checks import (
    offset_warning,
    unit_warning,
    zero_warning,
)
from pneuforce.instrument.validation.reference_pairs import PressureCourse
from pneuforce.support.columns import Points

#: Times of a reference from this time on are seconds since 1970. No other clock has run for 30 years.
FIRST_UTC_S = 1e9


class ReferenceInput(NamedTuple):
    """File of a reference force, and how to read the file."""

    file: Path
    columns: ReferenceColumns = ReferenceColumns()
    offset_s: float | None = None  #: clock offset; None: estimate the offset
    tare: bool = False  #: subtract the reading of the unloaded reference sensor
    #: Both clocks show the right time: the start of the recording (UTC) gives the offset.
    by_utc: bool = False


class AlignedReference(NamedTuple):
    """Reference force with times since the beginning of the recording [s], and how it was aligned."""

    force: Points
    offset: ClockOffset
    offset_given: bool  #: True if the offset was given, False if it was estimated
    free_force_n: float  #: reading of the reference sensor without contact; NaN if it is not known
    tare: bool  #: True if `free_force_n` was subtracted
    warnings: tuple[str, ...]  #: signs of a wrong offset, clock rate, unit or zero
    is_doubtful: bool = False  #: True if the offset or the unit is probably wrong

    @property
    def zero_n(self) -> float:
        """Return the reading without contact that `force` contains [N], NaN if it is not known."""
        return 0.0 if self.tare and math.isfinite(self.free_force_n) else self.free_force_n

    def summary(self) -> Iterator[str]:
        """Yield one sentence for each step of the alignment, and for each warning."""
        offset_s, correlation = self.offset
        known = f"{correlation:.3f}" if math.isfinite(correlation) else "n/a"
        how = "given" if self.offset_given else "estimated"
        yield (
            f"clock offset: {offset_s:+z.3f} s ({how}, correlation {known}); "
            "recording time = reference time + offset"
        )
        if math.isfinite(self.free_force_n):
            action = "was subtracted" if self.tare else "was not subtracted"
            yield f"reference force without contact: {self.free_force_n:+.3f} N, {action}"
        for warning in self.warnings:
            yield f"warning: {warning}"

    def facts(self) -> dict[str, Any]:
        """Return the steps of the alignment as JSON data."""
        return {
            **self.offset._asdict(),
            "offset_given": self.offset_given,
            "free_force_n": self.free_force_n,
            "warnings": list(self.warnings),
        }


def align_reference(
    reference: Points, given: ReferenceInput, course: PressureCourse, begin_utc_s: float = math.nan
) -> AlignedReference:
    """Return the reference force on the clock of the recording, in which the contacts of `course` are.

    If the times of the reference are seconds since 1970, and the recording began at `begin_utc_s`, offsets
    near the difference of these clocks are preferred.

    Raises ConfigurationError if the clock offset is not given and cannot be estimated, and if the offset of
    two UTC clocks is requested but not known.
    """
    signal = Signal(reference["t_s"], reference["force_n"])
    utc_offset_s = -begin_utc_s if signal.t_s[0] >= FIRST_UTC_S else math.nan
    if given.by_utc:
        given = given._replace(offset_s=_known_offset_s(utc_offset_s, begin_utc_s))
    offset = _clock_offset(signal, given.offset_s, course, utc_offset_s)
    at_recording = Signal(signal.t_s + offset.offset_s, signal.value)
    free_n = course.free_force_n(at_recording)
    zero_n = free_n if given.tare and math.isfinite(free_n) else 0.0
    wrong_offset = offset_warning(offset, course, signal) if given.offset_s is not None else ""
    wrong_unit = "" if wrong_offset else unit_warning(course.contacts, at_recording, given.columns.unit)
    begins_s = [contact.begin_s for contact in course.contacts]
    wrong_rate = "" if wrong_offset else rate_warning(begins_s, course.signal, at_recording)
    warnings = (wrong_offset, wrong_rate, wrong_unit, "" if given.tare else zero_warning(free_n))
    force = shifted(reference, offset.offset_s, zero_n)
    known = tuple(filter(None, warnings))
    is_doubtful = bool(wrong_offset or wrong_unit)
    return AlignedReference(force, offset, given.offset_s is not None, free_n, given.tare, known, is_doubtful)


def _known_offset_s(utc_offset_s: float, begin_utc_s: float) -> float:
    """Return the offset of two UTC clocks. Raises ConfigurationError if it is not known."""
    if math.isfinite(utc_offset_s):
        return utc_offset_s
    if math.isnan(begin_utc_s):
        raise ConfigurationError(
            "--offset utc cannot be used, because the recording does not contain its start in UTC: give the "
            "offset in s"
        )
    raise ConfigurationError(
        "--offset utc cannot be used, because the times of the reference are not seconds since 1970: name "
        "the column with these times with --time-column"
    )


def _clock_offset(
    signal: Signal, given_s: float | None, course: PressureCourse, expected_s: float
) -> ClockOffset:
    """Return the given or the estimated offset of a reference force."""
    if given_s is not None:
        known = len(course.t_s) > 0
        return ClockOffset(given_s, correlation_at(given_s, course.signal, signal) if known else math.nan)
    if not course.contacts:
        raise ConfigurationError(
            "the clock offset cannot be estimated, because the recording contains no contact: give --offset"
        )
    return estimate_offset(course.signal, signal, expected_s)
