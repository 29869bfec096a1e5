"""`pneuforce calibrate contacts`: contacts with a reference force, from a recording or from the simulator."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.output import json_line, print_text, progress
from pneuforce.instrument.recording.contacts import tube_time_constant_of
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.reader import Recording
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.instrument.validation.clock_offset import ClockOffset, Signal, estimate_offset
from pneuforce.instrument.validation.reference import ReferenceColumns, read, shifted
from pneuforce.instrument.validation.reference_pairs import (
    PairedContact,
    PressureCourse,
    UnpairedContact,
    pair_reference,
)
from pneuforce.support.atomic_file import check_new, write_lines

PROGRESS_SAMPLES = 1000  #: number of samples between two progress reports
#: Reading of an unloaded reference sensor [N] above which a warning is printed.
MAX_FREE_FORCE_N = 0.02


class PairingInput(NamedTuple):
    """Recording and reference force, and how to read the reference."""

    recording: Path
    reference: Path
    columns: ReferenceColumns
    offset_s: float | None  #: clock offset; None: estimate the offset
    tare: bool  #: subtract the reading of the unloaded reference sensor


class Pairing(NamedTuple):
    """Result: contacts with and without a reference force, the clock offset, and the reading without load."""

    paired: list[PairedContact]
    unpaired: list[UnpairedContact]
    offset: ClockOffset
    free_force_n: float  #: reading of the reference sensor without contact; NaN if it is not known
    remark: str  #: remark about the recording; "" if there is none


def pair(given: PairingInput) -> Pairing:
    """Return the contacts of the recording with their reference force.

    Raises ConfigurationError if a file is invalid, if the clock offset cannot be estimated, or if no contact
    has a reference force.
    """
    reference = read(given.reference, given.columns)
    with open_recording(given.recording) as recording:
        course = PressureCourse(tube_time_constant_of(recording.metadata))
        course.add_samples(_relative_samples(recording))
        remark = recording.remark()
    if not course.contacts:
        raise ConfigurationError(f"{given.recording}: the recording contains no contact {remark}".rstrip())
    signal = Signal(reference["t_s"], reference["force_n"])
    offset = (
        estimate_offset(course.signal, signal)
        if given.offset_s is None
        else ClockOffset(given.offset_s, math.nan)
    )
    free_n = course.free_force_n(Signal(signal.t_s + offset.offset_s, signal.value))
    zero_n = free_n if given.tare and math.isfinite(free_n) else 0.0
    paired, unpaired = pair_reference(course, shifted(reference, offset.offset_s, zero_n))
    return Pairing(paired, unpaired, offset, free_n, remark)


def write_pairing(given: PairingInput, out: Path | None, overwrite: bool, as_json: bool) -> int:
    """Pair the contacts, write or print the table, and report the contacts without a pair.

    Return the exit code, 1 if no contact is paired. Raises ConfigurationError.
    """
    _check_out(out, overwrite)
    found = pair(given)
    lines = [*_comments(given, found), *_csv_lines(PairedContact._fields, found.paired)]
    if out is not None:
        write_lines(out, (f"{line}\n" for line in lines))
    if as_json:
        print_text(json_line(_facts(found)))
    else:
        if out is None:
            print_text("\n".join(lines))
        print_text("\n".join(_summary(given, found)), sys.stderr if out is None else sys.stdout)
    return 0 if found.paired else 1


def write_simulated(lines: Iterable[str], out: Path | None, overwrite: bool) -> None:
    """Write simulated contacts to a file, or print them. Raises ConfigurationError."""
    _check_out(out, overwrite)
    if out is None:
        for line in lines:
            print_text(line)
    else:
        write_lines(out, (f"{line}\n" for line in lines))


def _check_out(out: Path | None, overwrite: bool) -> None:
    if out is not None:
        check_new(out, overwrite)


def _relative_samples(recording: Recording) -> Iterator[SampleRecord]:
    """Yield the samples with times since the beginning of the recording, and show the progress."""
    with progress("reading") as report:
        for number, m in enumerate(recording.samples()):
            if number % PROGRESS_SAMPLES == 0:
                report(number, recording.sample_count)
            yield m._replace(t_s=m.t_s - recording.begin_s)


def _comments(given: PairingInput, found: Pairing) -> list[str]:
    return [
        f"# {len(found.paired)} contacts of {given.recording.name} with the force of {given.reference.name}, "
        f"clock offset {found.offset.offset_s:+.3f} s"
    ]


def _csv_lines(names: Iterable[str], rows: Iterable[PairedContact]) -> Iterator[str]:
    yield ",".join(names)
    for row in rows:
        yield ",".join(f"{value:.5f}" if isinstance(value, float) else str(value) for value in row)


def _summary(given: PairingInput, found: Pairing) -> Iterator[str]:
    offset = found.offset
    how = "given" if given.offset_s is not None else f"estimated, correlation {offset.correlation:.3f}"
    yield f"clock offset: {offset.offset_s:+.3f} s ({how}); recording time = reference time + offset"
    total = len(found.paired) + len(found.unpaired)
    yield f"{len(found.paired)} of {total} contacts are paired with a reference force"
    for contact in found.unpaired:
        yield f"contact {contact.contact} at {contact.begin_s:.2f} s is not paired: {contact.reason}"
    if math.isfinite(found.free_force_n):
        action = "was subtracted" if given.tare else "was not subtracted"
        yield f"reference force without contact: {found.free_force_n:+.3f} N, {action}"
        if abs(found.free_force_n) > MAX_FREE_FORCE_N and not given.tare:
            yield "the reference sensor does not read 0 without load: set it to zero, or use --tare"
    if found.remark:
        yield found.remark


def _facts(found: Pairing) -> dict[str, Any]:
    return {
        "offset_s": found.offset.offset_s,
        "correlation": found.offset.correlation,
        "free_force_n": found.free_force_n,
        "paired": [contact._asdict() for contact in found.paired],
        "unpaired": [contact._asdict() for contact in found.unpaired],
        "remark": found.remark,
    }
