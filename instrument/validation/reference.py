"""Combination of recorded pressures and a reference force into one recording for a validation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.measurement.lag import SAMPLE_S
from pneuforce.instrument.validation.recording import REQUIRED_COLUMNS
from pneuforce.support import atomic_file
from pneuforce.support.columns import CsvTable, Numbers, Points, parse_points, parse_table

BATCH_SIZE = 5000
#: Longest accepted gap between two reference readings: one and a half periods of a logger of 10 Hz.
MAX_REFERENCE_GAP_S = 0.15
#: Newtons per unit of a reference force. gf (or g) and kgf are the weights of 1 g and 1 kg.
FORCE_UNITS_N = {
    "N": 1.0,
    "mN": 1e-3,
    "gf": 9.80665e-3,
    "g": 9.80665e-3,
    "kgf": 9.80665,
    "lbf": 4.4482216152605,
}


class PressureSample(NamedTuple):
    """One sample of the pressure, without a reference force."""

    t_s: float
    pressure_kpa: float  #: gauge, zeroed; NaN if the sensor reading is invalid
    locked: bool


class ReferenceColumns(NamedTuple):
    """Names of the two columns of a reference force, and the unit and the sign of the force."""

    time: str = "t_s"
    force: str = "force_n"
    unit: str = "N"
    inverted: bool = False  #: True if the reading falls when the force on the balloon rises


_DEFAULT_COLUMNS = ReferenceColumns()


def read(path: Path, columns: ReferenceColumns = _DEFAULT_COLUMNS) -> Points:
    """Return a reference force over time, with the columns t_s [s] and force_n [N].

    Lines with the same time become one reading, the mean of their forces: a logger on a busy computer repeats
    times, and so does a logger that rounds its times.

    Raises ConfigurationError if the file is invalid, or if the time falls from line to line.
    """
    content = atomic_file.read_file(path)
    _check_columns(parse_table(content, str(path)), columns)
    points = parse_points(content, str(path), [(columns.time, columns.force)])
    falling = np.flatnonzero(np.diff(points[columns.time]) < 0.0)
    if len(falling):
        raise points.error(f"{columns.time}: the time falls", int(falling[0]) + 1)
    newtons_per_unit = FORCE_UNITS_N[columns.unit] * (-1 if columns.inverted else 1)
    force_n = newtons_per_unit * points[columns.force]
    readings = _with_mean_of_equal_times(
        replace(points, columns={"t_s": points[columns.time], "force_n": force_n})
    )
    readings.require_rows(2)
    step_s = float(np.median(np.diff(readings["t_s"])))
    if len(readings) < len(points) and step_s > MAX_REFERENCE_GAP_S:
        raise points.error(
            f"{columns.time}: the times have steps of {step_s:g} s, and several lines have the same time: "
            f"use a column with steps of at most {MAX_REFERENCE_GAP_S:g} s"
        )
    return readings


def _with_mean_of_equal_times(reference: Points) -> Points:
    """Return one reading for each time. The times of `reference` do not fall."""
    times_s, first, counts = np.unique(reference["t_s"], return_index=True, return_counts=True)
    force_n = np.add.reduceat(reference["force_n"], first) / counts
    lines = [reference.lines[row] for row in first]
    return replace(reference, columns={"t_s": times_s, "force_n": force_n}, lines=lines)


def _check_columns(table: CsvTable, columns: ReferenceColumns) -> None:
    """Raise ConfigurationError, which names the option, if a column is missing."""
    for option, name in (("--time-column", columns.time), ("--force-column", columns.force)):
        if name not in table.names:
            raise ConfigurationError(
                f"{table.file} has no column {name}, only {', '.join(table.names)}: "
                f"name the column with {option}"
            )


def shifted(reference: Points, offset_s: float, zero_n: float = 0.0) -> Points:
    """Return a reference whose times are later by `offset_s`, and whose forces are lower by `zero_n`."""
    columns = {"t_s": reference["t_s"] + offset_s, "force_n": reference["force_n"] - zero_n}
    return replace(reference, columns=columns)


def recording_lines(samples: Iterable[PressureSample], reference: Points) -> Iterator[str]:
    """Yield the lines of a recording: each sample that the reference covers, with its force and phase.

    The force is interpolated linearly between two readings of the reference. Raises ConfigurationError if the
    reference covers no sample.
    """
    yield ",".join([*REQUIRED_COLUMNS, "phase"]) + "\n"
    row_count, before_s = 0, -np.inf
    numbered = _with_phase(spread_times(samples))
    while batch := list(islice(numbered, BATCH_SIZE)):
        t_s = np.array([sample.t_s for sample, _ in batch])
        force_n = force_at(t_s, reference)
        for (sample, phase), force in zip(batch, force_n.tolist(), strict=True):
            has_values = math.isfinite(force) and math.isfinite(sample.pressure_kpa)
            if has_values and sample.t_s > before_s:
                before_s, row_count = sample.t_s, row_count + 1
                yield f"{sample.t_s:.6f},{sample.pressure_kpa:.5f},{force:.5f},{phase}\n"
    if not row_count:
        first_s, last_s = reference["t_s"][[0, -1]]
        raise ConfigurationError(
            f"{reference.name}: the reference from {first_s:g} s to {last_s:g} s covers no sample: "
            "its t_s must count from the beginning of the recording"
        )


def spread_times(samples: Iterable[PressureSample]) -> Iterator[PressureSample]:
    """Yield the samples, and distribute samples with the same time up to the time of the next sample.

    The times of a recording stand still while the host is busy. Without these samples, the recording would
    have a gap, which begins a new trial in the middle of a contact.
    """
    run: list[PressureSample] = []
    for sample in samples:
        if run and sample.t_s != run[0].t_s:
            step_s = min(max((sample.t_s - run[0].t_s) / len(run), 0.0), SAMPLE_S)
            yield from (each._replace(t_s=each.t_s + n * step_s) for n, each in enumerate(run))
            run = []
        run.append(sample)
    yield from run


def force_at(t_s: Numbers, reference: Points) -> Numbers:
    """Return the reference force [N] at the times `t_s`.

    The force is NaN outside the reference, and between readings that are more than `MAX_REFERENCE_GAP_S`
    apart.
    """
    known_s = reference["t_s"]
    after = np.clip(np.searchsorted(known_s, t_s), 1, len(known_s) - 1)
    close = known_s[after] - known_s[after - 1] <= MAX_REFERENCE_GAP_S
    force_n = np.interp(t_s, known_s, reference["force_n"], left=np.nan, right=np.nan)
    return np.where(close, force_n, np.nan)


def _with_phase(samples: Iterable[PressureSample]) -> Iterator[tuple[PressureSample, str]]:
    """Yield each sample with the number of its locked period, or "" while the balloon is not locked."""
    number, locked = 0, False
    for sample in samples:
        number += sample.locked and not locked
        locked = sample.locked
        yield sample, str(number) if locked else ""
