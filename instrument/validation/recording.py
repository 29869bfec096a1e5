"""Validation recordings as CSV files: each line has the balloon pressure and the reference force."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.validation.trial import MAX_GAP_S, MIN_DURATION_S, Trial, TrialSample, split_trials
from pneuforce.support import atomic_file
from pneuforce.support.columns import CsvRow, CsvTable, parse_table

REQUIRED_COLUMNS = ("t_s", "pressure_kpa", "force_n")
#: Columns that only the samples of an instrument have (`export`, `evaluate --samples`). There, force_n is the
#: force of the instrument. force_std_n is not listed, because a reference sensor can have an uncertainty too.
INSTRUMENT_COLUMNS = ("sequence", "force_uncompensated_n")
#: Optional columns that divide the recording into trials: a new trial starts when a value changes. The
#: balloon is not locked in rows whose phase is empty.
TRIAL_COLUMNS = ("phase", "setpoint_kpa")


class ColumnRange(NamedTuple):
    """Smallest and largest allowed value of a column, and an explanation for the error message."""

    low: float
    high: float
    explanation: str


COLUMN_RANGES: Mapping[str, ColumnRange] = {
    "t_s": ColumnRange(-math.inf, math.inf, ""),
    "pressure_kpa": ColumnRange(
        -60.0, 60.0, "beyond the range of the sensor: is the unit Pa or hPa, or the pressure absolute?"
    ),
    "force_n": ColumnRange(-50.0, 50.0, "more than the balloon can bear: is the unit mN or g?"),
}


def read(path: Path) -> tuple[Trial, ...]:
    """Return the trials of a recording.

    Raises ConfigurationError with file, line and column if a row is invalid, if there is no trial, or if the
    only force is that of the instrument.
    """
    table = parse_table(atomic_file.read_file(path), str(path))
    _require_reference(table, path)
    trials = split_trials(_samples(table))
    if not trials:
        raise ConfigurationError(
            f"{path}: no samples of a locked balloon for more than {MIN_DURATION_S} s without a gap of "
            f"more than {MAX_GAP_S} s: is t_s in seconds?"
        )
    return trials


def write(path: Path, trials: Iterable[Trial]) -> None:
    """Write trials as a recording. The column `phase` numbers the trials from 1.

    Raises ConfigurationError if the file cannot be written.
    """
    atomic_file.write_lines(path, _lines(trials))


def _lines(trials: Iterable[Trial]) -> Iterator[str]:
    yield ",".join([*REQUIRED_COLUMNS, "phase"]) + "\n"
    for number, trial in enumerate(trials, 1):
        for t_s, kpa, force_n in zip(trial.t_s, trial.pressure_kpa, trial.force_n, strict=True):
            yield f"{t_s:.3f},{kpa:.5f},{force_n:.5f},{number}\n"


def _require_reference(table: CsvTable, path: Path) -> None:
    found = [name for name in INSTRUMENT_COLUMNS if name in table.names]
    if found:
        raise ConfigurationError(
            f"{path}: force_n is the force of the instrument, as the column {found[0]} shows, so it would be "
            "compared with itself: make the table from the recording and the file of a reference sensor, "
            "with pneuforce export --format validation --reference"
        )


def _samples(table: CsvTable) -> Iterator[TrialSample]:
    table.require_columns(REQUIRED_COLUMNS)
    trial_columns = [name for name in TRIAL_COLUMNS if name in table.names]
    before_s = -math.inf
    for row in table.rows:
        t_s, pressure_kpa, force_n = (_number(row, name) for name in REQUIRED_COLUMNS)
        if not t_s > before_s:
            raise row.error(f"t_s: time must rise, from {before_s:g} s to {t_s:g} s")
        before_s = t_s
        yield TrialSample(t_s, pressure_kpa, force_n, _trial_label(row, trial_columns))


def _number(row: CsvRow, name: str) -> float:
    value, allowed = row.number(name), COLUMN_RANGES[name]
    if not allowed.low <= value <= allowed.high:
        raise row.error(f"{name} = {value:g} is {allowed.explanation}")
    return value


def _trial_label(row: CsvRow, trial_columns: Iterable[str]) -> tuple[str, ...] | None:
    """Return the values that identify the trial of a row, None if the balloon is not locked."""
    values = {name: row.cells[name] for name in trial_columns}
    return None if values.get("phase") == "" else tuple(values.values())
