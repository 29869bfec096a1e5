"""`pneuforce export`: the samples of a recording as a table that other programs read."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from instrument import whole_file
from instrument.cli.showing import Told, progress
from instrument.errors import ConfigurationError
from instrument.tape.measured import Measured
from instrument.tape.opening import opened
from instrument.tape.reading import Recording
from instrument.tape.sheet import check_parquet, csv_lines, since, write_parquet

FORMATS = {".csv": "csv", ".parquet": "parquet"}
TOLD_EVERY = 1000  #: samples


class Wanted(NamedTuple):
    """What is to be made."""

    out: Path
    form: str | None = None  #: by the name of the file where it is None
    from_s: float = -math.inf
    to_s: float = math.inf
    reference: Path | None = None


class Span:
    """Samples as they pass by: how many, and from when to when."""

    def __init__(self) -> None:
        self.rows, self.first_s, self.last_s = 0, math.nan, math.nan

    def watched(self, samples: Iterable[Measured], told: Told, end_s: float) -> Iterator[Measured]:
        """The same samples, told to a progress bar."""
        total_s = end_s if math.isfinite(end_s) else None
        for sample in samples:
            self.first_s = sample.t_s if not self.rows else self.first_s
            self.last_s = sample.t_s
            if self.rows % TOLD_EVERY == 0:
                told(sample.t_s, total_s)
            self.rows += 1
            yield sample


def export(path: Path, wanted: Wanted, as_json: bool) -> int:
    """Make the table, and say what is in it; exit code 1 where the recording is damaged.

    Raises ConfigurationError: a file or an option that cannot be used.
    """
    form = _checked(path, wanted)
    span = Span()
    with opened(path) as recording:
        with progress("exporting") as told:
            end_s = min(recording.extent_s, wanted.to_s)
            _write(form, wanted, recording, span.watched(_samples(recording, wanted), told, end_s))
        remark = recording.remark()
        facts = {
            "file": str(path),
            "out": str(wanted.out),
            "format": form,
            "samples": span.rows,
            "from_s": span.first_s,
            "to_s": span.last_s,
            "remark": remark,
        }
        damaged = bool(recording.damage)
    if remark:
        print(f"pneuforce: {remark}", file=sys.stderr)
    words = f"{wanted.out}: {span.rows} samples, {max(span.first_s, 0.0):.1f} s to {span.last_s:.1f} s"
    print(json.dumps(facts) if as_json else words)
    return 1 if damaged else 0


def _checked(path: Path, wanted: Wanted) -> str:
    """The format. Raises ConfigurationError before a long run, not after it."""
    form = wanted.form or FORMATS.get(wanted.out.suffix.lower())
    if form is None:
        raise ConfigurationError(
            f"{wanted.out}: say with --format whether it is to be csv, parquet or validation"
        )
    if wanted.out.exists() and path.exists() and wanted.out.samefile(path):
        raise ConfigurationError(f"{path} is the recording itself: name another file to make")
    if not wanted.from_s < wanted.to_s:
        raise ConfigurationError("--from-s must be less than --to-s")
    if form == "parquet":
        check_parquet()
    if form != "validation" and wanted.reference:
        raise ConfigurationError("--reference is for --format validation")
    if form == "validation" and not wanted.reference:
        raise ConfigurationError(
            "a recording knows no true force: give with --reference a CSV with the columns t_s, "
            "in seconds since the beginning of the recording, and force_n"
        )
    whole_file.check_writable(wanted.out)
    return form


def _samples(recording: Recording, wanted: Wanted) -> Iterator[Measured]:
    """The samples that are wanted, from the first on. Raises ConfigurationError where there is none."""
    samples = since(recording.begin_s, recording.samples(wanted.from_s, wanted.to_s))
    first = next(samples, None)
    if first is None:
        why = recording.remark() or f"it has {recording.most_samples} samples in {recording.extent_s:.1f} s"
        raise ConfigurationError(f"{recording.path}: no samples there ({why})")
    return chain([first], samples)


def _write(form: str, wanted: Wanted, recording: Recording, samples: Iterator[Measured]) -> None:
    if form == "csv":
        whole_file.write(wanted.out, csv_lines(samples))
    elif form == "parquet":
        with whole_file.in_place_of(wanted.out) as new:
            write_parquet(new, samples, recording.about)
    else:
        assert wanted.reference is not None
        _write_validation(wanted.out, samples, wanted.reference)


def _write_validation(out: Path, samples: Iterator[Measured], reference: Path) -> None:
    from instrument.validation.reference import Pressure, beside, read

    pressures = (Pressure(m.t_s, m.unfiltered_kpa, math.isfinite(m.initial_kpa)) for m in samples)
    whole_file.write(out, beside(pressures, read(reference)))
