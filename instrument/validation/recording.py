"""Recordings as CSV: pressure of the balloon beside a reference force, checked row by row."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from instrument.errors import ConfigurationError
from instrument.validation.trial import LONGEST_GAP_S, SHORTEST_S, Row, Trial, trials_of

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
    """The trials of a recording. Raises ConfigurationError with file, row and column."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            trials = trials_of(_rows(path, csv.reader(file)))
    except FileNotFoundError:
        raise ConfigurationError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ConfigurationError(f"{path}: cannot be read: {error}") from None
    if not trials:
        raise ConfigurationError(
            f"{path}: no samples of a locked balloon that are less than {LONGEST_GAP_S} s apart for "
            f"{SHORTEST_S} s: is t_s in seconds?"
        )
    return trials


def write(path: Path, trials: Sequence[Trial]) -> None:
    """Write trials as a recording, numbered by phase from 1. Raises ConfigurationError."""
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            file.write(",".join([*NEEDED, "phase"]) + "\n")
            for number, trial in enumerate(trials, 1):
                samples = zip(trial.t_s, trial.pressure_kpa, trial.force_n, strict=True)
                file.writelines(f"{t:.3f},{kpa:.5f},{n:.5f},{number}\n" for t, kpa, n in samples)
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be written: {error.strerror}") from None


def _rows(path: Path, lines: Iterator[list[str]]) -> Iterator[Row]:
    names = [name.strip() for name in next(lines, [])]
    missing = [name for name in NEEDED if name not in names]
    if missing:
        raise ConfigurationError(
            f"{path}, row 1: the column {missing[0]} is missing; a header {','.join(NEEDED)} is expected"
        )
    needed = [(name, names.index(name)) for name in NEEDED]
    marks = [(name, names.index(name)) for name in MARKS if name in names]
    before_s = -math.inf
    for number, cells in enumerate(lines, 2):
        if cells:
            place = f"{path}, row {number}"
            if len(cells) != len(names):
                raise ConfigurationError(f"{place}: {len(cells)} columns, the header has {len(names)}")
            t_s, pressure_kpa, force_n = (_number(place, name, cells[at]) for name, at in needed)
            if not t_s > before_s:
                raise ConfigurationError(
                    f"{place}, column t_s: time must rise, from {before_s:g} s to {t_s:g} s"
                )
            before_s = t_s
            yield Row(t_s, pressure_kpa, force_n, _trial((name, cells[at].strip()) for name, at in marks))


def _number(place: str, name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ConfigurationError(f"{place}, column {name}: {text.strip()!r} is not a number") from None
    span = SPANS[name]
    if not math.isfinite(value):
        raise ConfigurationError(f"{place}, column {name}: {value} is not a finite number")
    if not span.low <= value <= span.high:
        raise ConfigurationError(f"{place}, column {name}: {value:g} is {span.suspicion}")
    return value


def _trial(marks: Iterable[tuple[str, str]]) -> tuple[str, ...] | None:
    """What the marks of a row say together; None where they say that the balloon is not locked."""
    known = dict(marks)
    return None if known.get("phase") == "" else tuple(known.values())
