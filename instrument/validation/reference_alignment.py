"""Reference force on the clock of a recording: clock offset, and reading of the unloaded reference sensor."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.validation.clock_offset import ClockOffset, Signal, estimate_offset
from pneuforce.instrument.validation.reference import ReferenceColumns, shifted
from pneuforce.instrument.validation.reference_pairs import PressureCourse
from pneuforce.support.columns import Points

#: Reading of an unloaded reference sensor [N] above which a warning is printed.
MAX_FREE_FORCE_N = 0.02


class ReferenceInput(NamedTuple):
    """File of a reference force, and how to read the file."""

    file: Path
    columns: ReferenceColumns = ReferenceColumns()
    offset_s: float | None = None  #: clock offset; None: estimate the offset
    tare: bool = False  #: subtract the reading of the unloaded reference sensor


class AlignedReference(NamedTuple):
    """Reference force with times since the beginning of the recording [s], and how it was aligned."""

    force: Points
    offset: ClockOffset  #: the correlation is NaN if the offset was given
    free_force_n: float  #: reading of the reference sensor without contact; NaN if it is not known
    tare: bool  #: True if `free_force_n` was subtracted

    def summary(self) -> Iterator[str]:
        """Yield one sentence for each step of the alignment."""
        offset_s, correlation = self.offset
        how = "given" if math.isnan(correlation) else f"estimated, correlation {correlation:.3f}"
        yield f"clock offset: {offset_s:+.3f} s ({how}); recording time = reference time + offset"
        if math.isfinite(self.free_force_n):
            action = "was subtracted" if self.tare else "was not subtracted"
            yield f"reference force without contact: {self.free_force_n:+.3f} N, {action}"
            if abs(self.free_force_n) > MAX_FREE_FORCE_N and not self.tare:
                yield "the reference sensor does not read 0 without load: set it to zero, or use --tare"

    def facts(self) -> dict[str, float]:
        """Return the steps of the alignment as JSON data."""
        return {**self.offset._asdict(), "free_force_n": self.free_force_n}


def align_reference(reference: Points, given: ReferenceInput, course: PressureCourse) -> AlignedReference:
    """Return the reference force on the clock of the recording, in which the contacts of `course` are.

    Raises ConfigurationError if the clock offset is not given and cannot be estimated.
    """
    signal = Signal(reference["t_s"], reference["force_n"])
    if given.offset_s is not None:
        offset = ClockOffset(given.offset_s, math.nan)
    elif course.contacts:
        offset = estimate_offset(course.signal, signal)
    else:
        raise ConfigurationError(
            "the clock offset cannot be estimated, because the recording contains no contact: give --offset"
        )
    free_n = course.free_force_n(Signal(signal.t_s + offset.offset_s, signal.value))
    zero_n = free_n if given.tare and math.isfinite(free_n) else 0.0
    return AlignedReference(shifted(reference, offset.offset_s, zero_n), offset, free_n, given.tare)
