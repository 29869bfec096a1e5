"""`pneuforce export`: write the samples or the contacts of a recording as a table for other programs."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain, count
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.recordings.aligned_reference import read_aligned
from pneuforce.instrument.cli.terminal.failure import checked_values
from pneuforce.instrument.cli.terminal.output import ReportProgress, json_text, print_text, progress
from pneuforce.instrument.recording.board_time import EXPORT_TYPES, BoardTime
from pneuforce.instrument.recording.contact_table import CONTACT_TYPES, collect_contacts, relative_contacts
from pneuforce.instrument.recording.contacts import tube_time_constant_of
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.reader import Recording
from pneuforce.instrument.recording.table_export import (
    Row,
    check_parquet,
    csv_lines,
    relative_to_begin,
    write_parquet,
)
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.instrument.validation.reference import PressureSample, recording_lines
from pneuforce.instrument.validation.reference_alignment import AlignedReference, ReferenceInput
from pneuforce.support import atomic_file
from pneuforce.support.columns import Points
from pneuforce.support.counted import counted

FORMATS = {".csv": "csv", ".parquet": "parquet"}
PROGRESS_SAMPLES = 1000  #: number of samples between two progress reports


class ExportOptions(NamedTuple):
    """Output file, format, time range and content of an export."""

    out: Path
    form: str | None = None  #: file format; None selects it by the suffix of `out`
    from_s: float = -math.inf
    to_s: float = math.inf
    reference: ReferenceInput | None = None
    contacts: bool = False  #: export one row per contact instead of one row per sample
    overwrite: bool = False


class SampleCounter:
    """Number and time range of the exported samples."""

    def __init__(self) -> None:
        self.rows, self.first_s, self.last_s = 0, math.nan, math.nan

    def count(
        self, samples: Iterable[SampleRecord], report: ReportProgress, end_s: float
    ) -> Iterator[SampleRecord]:
        """Yield `samples` unchanged, count them, and report the progress."""
        total_s = end_s if math.isfinite(end_s) else None
        for sample in samples:
            self.first_s = sample.t_s if not self.rows else self.first_s
            self.last_s = sample.t_s
            if self.rows % PROGRESS_SAMPLES == 0:
                report(sample.t_s, total_s)
            self.rows += 1
            yield sample


def export(path: Path, options: ExportOptions, as_json: bool) -> int:
    """Write the table and print a summary. Return the exit code, 1 if the recording is damaged.

    Raises ConfigurationError if a file or an option cannot be used.
    """
    form = _check_options(path, options)
    counter = SampleCounter()
    with open_recording(path) as recording:
        aligned = None if options.reference is None else read_aligned(recording, options.reference)[1]
        with progress("exporting") as report:
            end_s = min(recording.extent_s, options.to_s)
            samples = counter.count(_selected_samples(recording, options), report, end_s)
            row_count = _write(form, options, recording, samples, aligned)
        remark = recording.remark()
        contact_count = row_count if options.contacts else None
        sample_count = row_count if row_count is not None and aligned else counter.rows
        facts = {
            "file": str(path),
            "out": str(options.out),
            "format": form,
            "samples": sample_count,
            "contacts": contact_count,
            "from_s": counter.first_s,
            "to_s": counter.last_s,
            **(aligned.facts() if aligned else {}),
            "remark": remark,
        }
        damaged = bool(recording.damage)
    if remark and not as_json:
        print_text(f"pneuforce: {remark}", sys.stderr)
    span = f"{max(counter.first_s, 0.0):.1f} s to {counter.last_s:.1f} s"
    rows = counted(sample_count, "sample") if contact_count is None else counted(contact_count, "contact")
    lines = [f"{options.out}: {rows}, {span}", *(aligned.summary() if aligned else ())]
    values = checked_values(not damaged, str(remark) if damaged else "; ".join(lines))
    print_text(json_text(values | facts) if as_json else "\n".join(lines))
    return 1 if damaged else 0


def _check_options(path: Path, options: ExportOptions) -> str:
    """Return the file format. Raises ConfigurationError if an option is invalid."""
    if str(options.out) == "-":
        raise ConfigurationError("an export cannot be written to the standard output: name a file")
    if options.out.is_dir():
        raise ConfigurationError(f"{options.out} is a folder: name a file")
    form = options.form or FORMATS.get(options.out.suffix.lower())
    if form is None:
        raise ConfigurationError(
            f"{options.out}: the format is unknown: choose --format csv, parquet or validation"
        )
    if options.out.exists() and path.exists() and options.out.samefile(path):
        raise ConfigurationError(f"{path} is the recording itself: name another output file")
    if not options.from_s < options.to_s:
        raise ConfigurationError("--from-s must be less than --to-s")
    if form == "parquet":
        check_parquet()
    if form != "validation" and options.reference:
        raise ConfigurationError("--reference is valid only with --format validation")
    if form == "validation" and not options.reference:
        raise ConfigurationError(
            "a recording contains no true force: name the CSV file of a reference sensor with --reference"
        )
    if form == "validation" and options.contacts:
        raise ConfigurationError("--contacts is not valid with --format validation, which needs all samples")
    atomic_file.check_new(options.out, options.overwrite)
    return form


def _selected_samples(recording: Recording, options: ExportOptions) -> Iterator[SampleRecord]:
    """Return the samples of the time range. Raises ConfigurationError if there are none."""
    samples = relative_to_begin(recording.begin_s, recording.samples(options.from_s, options.to_s))
    first = next(samples, None)
    if first is None:
        raise ConfigurationError(recording.no_samples())
    return chain([first], samples)


def _write(
    form: str,
    options: ExportOptions,
    recording: Recording,
    samples: Iterator[SampleRecord],
    aligned: AlignedReference | None,
) -> int | None:
    """Write the table. Return the number of its rows; None if the table contains all samples."""
    if aligned is not None:
        return _write_validation(options.out, samples, aligned.force)
    if not options.contacts:
        board = BoardTime()
        rows = ((*m, board.at_s(m)) for m in samples)
        write_table(options.out, form, rows, EXPORT_TYPES, recording.metadata)
        return None
    contacts = collect_contacts(samples, tube_time_constant_of(recording.metadata))
    contact_rows = relative_contacts(0.0, contacts)
    write_table(options.out, form, contact_rows, CONTACT_TYPES, recording.metadata)
    return len(contacts)


def write_table(
    out: Path, form: str, rows: Iterable[Row], types: Mapping[str, type], metadata: Mapping[str, Any]
) -> None:
    """Write rows as CSV or as Parquet. Raises ConfigurationError if the file cannot be written."""
    if form == "csv":
        atomic_file.write_lines(out, csv_lines(rows, types))
        return
    with atomic_file.replaced_user_file(out) as new:
        write_parquet(new, rows, types, metadata)


def _write_validation(out: Path, samples: Iterator[SampleRecord], reference: Points) -> int:
    """Write the samples that the reference covers. Return their number."""
    pressures = (PressureSample(m.t_s, m.unfiltered_kpa, math.isfinite(m.baseline_kpa)) for m in samples)
    line_numbers = count()
    lines = zip(recording_lines(pressures, reference), line_numbers, strict=False)
    atomic_file.write_lines(out, (line for line, _ in lines))
    return next(line_numbers) - 1  # the first line has the names of the columns
