"""`pneuforce calibrate contacts`: contacts with a reference force, from a recording or from the simulator."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.contacts import RECORDING_COLUMN, ZERO_COLUMN
from pneuforce.instrument.cli.recordings.aligned_reference import read_aligned
from pneuforce.instrument.cli.terminal.failure import checked_values
from pneuforce.instrument.cli.terminal.output import json_line, print_text
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.validation.reference_alignment import AlignedReference, ReferenceInput
from pneuforce.instrument.validation.reference_pairs import (
    PairedContact,
    UnpairedContact,
    pair_reference,
)
from pneuforce.support.atomic_file import check_new, write_lines
from pneuforce.support.counted import counted


class PairingInput(NamedTuple):
    """Recording and reference force."""

    recording: Path
    reference: ReferenceInput
    from_s: float = -math.inf  #: contacts that begin earlier are not paired
    to_s: float = math.inf  #: contacts that end later are not paired


class Pairing(NamedTuple):
    """Result: contacts with and without a reference force, and how the reference was aligned."""

    paired: list[PairedContact]
    unpaired: list[UnpairedContact]
    aligned: AlignedReference
    begin_utc_s: float  #: start of the recording, in seconds since 1970; NaN if it is not known
    remark: str  #: remark about the recording; "" if there is none
    damaged: bool  #: True if a part of the recording could not be read


def pair(given: PairingInput) -> Pairing:
    """Return the contacts of the recording with their reference force.

    Raises ConfigurationError if a file is invalid, if the clock offset cannot be estimated, or if the
    recording contains no contact.
    """
    with open_recording(given.recording) as recording:
        course, aligned = read_aligned(recording, given.reference)
        course.select(given.from_s, given.to_s)
        remark, damaged, begin_utc_s = recording.remark(), bool(recording.damage), recording.begin_utc_s
    if not course.contacts:
        raise ConfigurationError(f"no contact was found: {remark or f'{given.recording} contains none'}")
    paired, unpaired = pair_reference(course, aligned.force)
    return Pairing(paired, unpaired, aligned, begin_utc_s, remark, damaged)


def write_pairing(given: PairingInput, out: Path | None, overwrite: bool, as_json: bool) -> int:
    """Pair the contacts, write or print the table, and report the contacts without a pair.

    Without any pair, no file is written. Return the exit code, 1 if no contact is paired, if the recording is
    damaged, or if the clock offset or the unit of the reference is probably wrong. Raises ConfigurationError.
    """
    _check_out(out, overwrite)
    found = pair(given)
    lines = [*_comments(given, found), *_csv_lines(found)]
    if out is not None and found.paired:
        write_lines(out, (f"{line}\n" for line in lines))
    passed = bool(found.paired) and not found.damaged and not found.aligned.is_doubtful
    if as_json:
        print_text(json_line(checked_values(passed, "; ".join(_summary(found))) | _facts(found)))
    else:
        if out is None and found.paired:
            print_text("\n".join(lines))
        print_text("\n".join(_summary(found)), sys.stderr if out is None else sys.stdout)
    return 0 if passed else 1


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


def _comments(given: PairingInput, found: Pairing) -> list[str]:
    recording, reference = given.recording.name, given.reference.file.name
    return [
        f"# {counted(len(found.paired), 'contact')} of {recording} with the force of {reference}, "
        f"clock offset {found.aligned.offset.offset_s:+z.3f} s"
    ]


def _csv_lines(found: Pairing) -> Iterator[str]:
    """Yield the table of the paired contacts, with the values that are common to all, if they are known."""
    common = {ZERO_COLUMN: found.aligned.zero_n, RECORDING_COLUMN: found.begin_utc_s}
    known = {name: value for name, value in common.items() if math.isfinite(value)}
    yield ",".join([*PairedContact._fields, *known])
    for row in found.paired:
        values = [*row, *known.values()]
        yield ",".join(f"{value:.5f}" if isinstance(value, float) else str(value) for value in values)


def _summary(found: Pairing) -> Iterator[str]:
    yield from found.aligned.summary()
    total = len(found.paired) + len(found.unpaired)
    yield f"paired with a reference force: {len(found.paired)} of {counted(total, 'contact')}"
    if not found.paired:
        yield "nothing was written"
    for contact in found.unpaired:
        yield f"contact {contact.contact} at {contact.begin_s:z.2f} s is not paired: {contact.reason}"
    if found.remark:
        yield found.remark


def _facts(found: Pairing) -> dict[str, Any]:
    return {
        **found.aligned.facts(),
        "paired": [contact._asdict() for contact in found.paired],
        "unpaired": [contact._asdict() for contact in found.unpaired],
        "remark": found.remark,
    }
