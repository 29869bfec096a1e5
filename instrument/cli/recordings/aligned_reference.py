"""Reading of a recording and of a reference force, and the alignment of their clocks."""

from __future__ import annotations

from collections.abc import Iterator

from pneuforce.instrument.cli.terminal.output import progress
from pneuforce.instrument.recording.contacts import tube_time_constant_of
from pneuforce.instrument.recording.reader import Recording
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.instrument.validation.reference import read
from pneuforce.instrument.validation.reference_alignment import (
    AlignedReference,
    ReferenceInput,
    align_reference,
)
from pneuforce.instrument.validation.reference_pairs import PressureCourse

PROGRESS_SAMPLES = 1000  #: number of samples between two progress reports


def read_aligned(recording: Recording, given: ReferenceInput) -> tuple[PressureCourse, AlignedReference]:
    """Return the pressures of the whole recording, and the reference force on the clock of the recording.

    Raises ConfigurationError if the reference is invalid, or if the clock offset cannot be estimated.
    """
    reference = read(given.file, given.columns)
    course = PressureCourse(tube_time_constant_of(recording.metadata))
    course.add_samples(_relative_samples(recording))
    return course, align_reference(reference, given, course, recording.begin_utc_s)


def _relative_samples(recording: Recording) -> Iterator[SampleRecord]:
    """Yield the samples with times since the beginning of the recording, and show the progress."""
    with progress("reading") as report:
        for number, m in enumerate(recording.samples()):
            if number % PROGRESS_SAMPLES == 0:
                report(number, recording.sample_count)
            yield m._replace(t_s=m.t_s - recording.begin_s)
