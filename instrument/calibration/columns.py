"""Recorded points: a CSV text with a header becomes columns of numbers, or a sentence with the row."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instrument.errors import ConfigurationError

Numbers = NDArray[np.float64]
MOST_ROWS = 1_000_000


@dataclass(frozen=True, slots=True)
class Recording:
    """Columns of one file. Row n of the data is line `lines[n]` of the file."""

    name: str
    sha256: str
    columns: dict[str, Numbers]
    lines: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.lines)

    def __getitem__(self, column: str) -> Numbers:
        return self.columns[column]

    def refusal(self, why: str, row: int | None = None) -> ConfigurationError:
        """The sentence that refuses this file, or one row of it."""
        where = self.name if row is None else f"{self.name}, line {self.lines[row]}"
        return ConfigurationError(f"{where}: {why}")

    def at_least(self, points: int) -> None:
        """Raises ConfigurationError where there are fewer points."""
        if len(self) < points:
            raise self.refusal(f"{len(self)} points, and at least {points} are needed")


def recording(
    data: bytes, name: str, choices: Sequence[Sequence[str]], also: Sequence[str] = ()
) -> Recording:
    """The columns of the first of `choices` that the header has, and those of `also` that it has.

    A line that begins with # is a comment. Raises ConfigurationError with the line.
    """
    header, rows, lines = _cells(data, name)
    columns = next((choice for choice in choices if set(choice) <= set(header)), None)
    if columns is None:
        wanted = " or ".join(", ".join(choice) for choice in choices)
        raise ConfigurationError(
            f"{name}: the first line must name the columns {wanted}, not {', '.join(header)}"
        )
    kept = [*columns, *(column for column in also if column in header)]
    numbers = {
        column: np.array([
            _number(row, header.index(column), f"{name}, line {line}", column)
            for row, line in zip(rows, lines, strict=True)
        ])
        for column in kept
    }  # fmt: skip
    return Recording(name, hashlib.sha256(data).hexdigest(), numbers, tuple(lines))


def _cells(data: bytes, name: str) -> tuple[list[str], list[list[str]], list[int]]:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigurationError(f"{name}: not a text in UTF-8") from None
    reader = csv.reader(io.StringIO(text), strict=True)
    found: list[tuple[int, list[str]]] = []
    try:
        for row in reader:
            if any(cell.strip() for cell in row) and not row[0].lstrip().startswith("#"):
                found.append((reader.line_num, [cell.strip() for cell in row]))
    except csv.Error as error:
        raise ConfigurationError(f"{name}, line {reader.line_num}: not CSV: {error}") from None
    if not found:
        raise ConfigurationError(f"{name}: empty")
    if len(found) > MOST_ROWS:
        raise ConfigurationError(f"{name}: more than {MOST_ROWS} lines")
    [(_, header), *rest] = found
    return header, [row for _, row in rest], [line for line, _ in rest]


def _number(row: list[str], index: int, where: str, column: str) -> float:
    cell = row[index] if index < len(row) else ""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ConfigurationError(f"{where}: {column} = {cell!r} is not a number")
    return value
