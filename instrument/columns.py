"""Recorded columns: a CSV text whose first line names them, row by row, or a sentence with the line."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from instrument.errors import ConfigurationError

Numbers = NDArray[np.float64]
MOST_ROWS = 4_000_000
#: No quantity of ours comes near it, and its square is still a number.
MOST = 1e15
#: What other countries' spreadsheets write.
AS_HERE = "use commas between columns, points in numbers"


class Row(NamedTuple):
    """One row, its cells by the names of their columns."""

    file: str
    line: int
    cells: Mapping[str, str]

    def refusal(self, why: str) -> ConfigurationError:
        """The sentence that refuses this row."""
        return ConfigurationError(f"{self.file}, line {self.line}: {why}")

    def number(self, column: str) -> float:
        """A number. Raises ConfigurationError."""
        cell = self.cells[column]
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if abs(value) <= MOST:
            return value
        why = "too large" if abs(value) < math.inf else f"not a number{f': {AS_HERE}' if ',' in cell else ''}"
        raise self.refusal(f"{column} = {cell!r} is {why}")


class Table(NamedTuple):
    """The named columns of a file, and its rows as they are read."""

    file: str
    names: tuple[str, ...]
    rows: Iterator[Row]

    def having(self, *choices: Sequence[str]) -> Sequence[str]:
        """The first choice of columns that are all there. Raises ConfigurationError where none is."""
        for choice in choices:
            if set(choice) <= set(self.names):
                return choice
        wanted = " or ".join(", ".join(choice) for choice in choices)
        raise ConfigurationError(
            f"{self.file}: the first line must name the columns {wanted}, not {', '.join(self.names)}"
        )


@dataclass(frozen=True, slots=True)
class Points:
    """Columns of numbers. Row n of them is line `lines[n]` of the file."""

    name: str
    sha256: str
    columns: dict[str, Numbers]
    lines: Sequence[int]

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


def table_in(content: bytes, file: str) -> Table:
    """The table of a CSV text. Blank lines and lines that begin with # are left out.

    Raises ConfigurationError, also while the rows are read.
    """
    if max(content.count(b"\n"), content.count(b"\r")) > MOST_ROWS:
        raise ConfigurationError(f"{file}: more than {MOST_ROWS} lines")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigurationError(f"{file}: not a text in UTF-8") from None
    rows = _rows(text, file)
    _, header = next(rows, (0, []))
    if not header:
        raise ConfigurationError(f"{file}: empty")
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        raise ConfigurationError(f"{file}: {AS_HERE}")
    return Table(file, tuple(header), _named(rows, file, header))


def points_in(
    content: bytes, name: str, choices: Sequence[Sequence[str]], also: Sequence[str] = ()
) -> Points:
    """The columns of the first of `choices` that the header has, and those of `also` that it has.

    Raises ConfigurationError with the line.
    """
    table = table_in(content, name)
    chosen = [*table.having(*choices), *(column for column in also if column in table.names)]
    columns = {column: array("d") for column in chosen}
    lines = array("q")
    for row in table.rows:
        lines.append(row.line)
        for column, numbers in columns.items():
            numbers.append(row.number(column))
    found = {column: np.array(numbers) for column, numbers in columns.items()}
    return Points(name, hashlib.sha256(content).hexdigest(), found, lines)


def _rows(text: str, file: str) -> Iterator[tuple[int, list[str]]]:
    told = ("\n" if line.lstrip().startswith("#") else line for line in io.StringIO(text, newline=""))
    reader = csv.reader(told, strict=True)
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if any(stripped):
                yield reader.line_num, stripped
    except csv.Error as error:
        raise ConfigurationError(f"{file}, line {reader.line_num}: not CSV: {error}") from None


def _named(rows: Iterator[tuple[int, list[str]]], file: str, header: list[str]) -> Iterator[Row]:
    for line, cells in rows:
        row = Row(file, line, dict(zip(header, cells, strict=False)))
        if len(cells) != len(header):
            hint = f": {AS_HERE}" if len(cells) > len(header) else ""
            raise row.refusal(f"{len(cells)} columns, the header has {len(header)}{hint}")
        yield row
