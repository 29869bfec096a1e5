"""Recordings as CSV: pressure of the balloon beside a reference force, checked line by line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from instrument import whole_file
from instrument.columns import Row, Table, table_in
from instrument.errors import ConfigurationError
from instrument.validation.trial import LONGEST_GAP_S, SHORTEST_S, Sample, Trial, trials_of

NEEDED = ("t_s", "pressure_kpa", "force_n")
#: Optional columns, each change of which begins a new trial; where phase is empty the balloon is not locked.
MARKS = ("phase", "setpoint_kpa")


class Span(NamedTuple):
    """What a column may contain, and what a number outside is usually mistaken for."""

    low: float
    high: float
    suspicion: str


SPANS: Mapping[str, Span] = {
    "t_s": Span(-math.inf, math.inf, ""),
    "pressure_kpa": Span(-60.0, 60.0, "more than the sensor can tell: is this Pa, hPa or absolute?"),
    "force_n": Span(-50.0, 50.0, "more than the balloon can bear: is this mN or g?"),
}


def read(path: Path) -> tuple[Trial, ...]:
    """The trials of a recording. Raises ConfigurationError with file, line and column."""
    trials = trials_of(_samples(table_in(whole_file.content_of(path), str(path))))
    if not trials:
        raise ConfigurationError(
            f"{path}: no samples of a locked balloon that are less than {LONGEST_GAP_S} s apart for "
            f"{SHORTEST_S} s: is t_s in seconds?"
        )
    return trials


def write(path: Path, trials: Iterable[Trial]) -> None:
    """Write trials as a recording, numbered by phase from 1. Raises ConfigurationError."""
    whole_file.write(path, _lines(trials))


def _lines(trials: Iterable[Trial]) -> Iterator[str]:
    yield ",".join([*NEEDED, "phase"]) + "\n"
    for number, trial in enumerate(trials, 1):
        for t, kpa, n in zip(trial.t_s, trial.pressure_kpa, trial.force_n, strict=True):
            yield f"{t:.3f},{kpa:.5f},{n:.5f},{number}\n"


def _samples(table: Table) -> Iterator[Sample]:
    table.having(NEEDED)
    marks = [name for name in MARKS if name in table.names]
    before_s = -math.inf
    for row in table.rows:
        t_s, pressure_kpa, force_n = (_number(row, name) for name in NEEDED)
        if not t_s > before_s:
            raise row.refusal(f"t_s: time must rise, from {before_s:g} s to {t_s:g} s")
        before_s = t_s
        yield Sample(t_s, pressure_kpa, force_n, _trial((name, row.cells[name]) for name in marks))


def _number(row: Row, name: str) -> float:
    value, span = row.number(name), SPANS[name]
    if not span.low <= value <= span.high:
        raise row.refusal(f"{name} = {value:g} is {span.suspicion}")
    return value


def _trial(marks: Iterable[tuple[str, str]]) -> tuple[str, ...] | None:
    """What the marks of a row say together; None where they say that the balloon is not locked."""
    known = dict(marks)
    return None if known.get("phase") == "" else tuple(known.values())
