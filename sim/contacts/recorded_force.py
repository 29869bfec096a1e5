"""Recorded forces: a CSV file with the columns t_s and force_n."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from io import StringIO
from pathlib import Path

from pneuforce.sim.contacts.trajectory import Polyline
from pneuforce.sim.plants.plant import MAX_PUSH_N
from pneuforce.support.atomic_file import read_file
from pneuforce.support.validation_errors import format_input

HEADER = ["t_s", "force_n"]


def read_recorded_force(path: Path) -> Polyline:
    """Return the forces of a file over the time since the first row.

    Raises ValueError with the file if the file cannot be read. The error also names the row if a number is
    missing, if the time does not increase, or if a force is outside 0 to 20 N.
    """
    content = read_file(path)
    try:
        points = list(_points(path, StringIO(content.decode(), newline="")))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read: {error}") from None
    if len(points) < 2:
        raise ValueError(f"{path}: at least two rows are required")
    start_s = points[0][0]
    return Polyline(tuple(t_s - start_s for t_s, _ in points), tuple(force_n for _, force_n in points))


def _points(path: Path, file: Iterator[str]) -> Iterator[tuple[float, float]]:
    rows = csv.reader(file)
    if [name.strip() for name in next(rows, [])] != HEADER:
        raise ValueError(f"{path}, row 1: the header must be {','.join(HEADER)}")
    before_s = -math.inf
    for number, row in enumerate(rows, 2):
        if row:
            t_s, force_n = _point(f"{path}, row {number}", row)
            if not t_s > before_s:
                raise ValueError(
                    f"{path}, row {number}: the time must increase, but {t_s:g} s follows {before_s:g} s"
                )
            before_s = t_s
            yield t_s, force_n


def _point(place: str, row: list[str]) -> tuple[float, float]:
    try:
        t_s, force_n = (float(cell) for cell in row)
    except ValueError:
        raise ValueError(f"{place}: two numbers are expected, not {format_input(','.join(row))}") from None
    if not math.isfinite(t_s):
        raise ValueError(f"{place}: {t_s} is not a valid time")
    if not 0 <= force_n <= MAX_PUSH_N:
        raise ValueError(f"{place}: {force_n:g} N is outside 0 to {MAX_PUSH_N:g} N")
    return t_s, force_n
