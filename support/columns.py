"""CSV files with named columns: parsing, checks, and error messages that name the file and the line."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from pneuforce.errors import ConfigurationError
from pneuforce.support.counted import counted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Numbers: TypeAlias = "NDArray[np.float64]"
MAX_ROWS = 4_000_000
#: Largest accepted magnitude of a number. Measured values are much smaller. The square does not overflow.
MAX_MAGNITUDE = 1e15
#: Spreadsheets in many countries write semicolons between columns and commas in numbers.
CSV_FORMAT_HINT = "use commas between columns, points in numbers"
#: Other separators between columns: name, and the character in an expression of sed.
_OTHER_SEPARATORS = {";": ("semicolons", ";"), "\t": ("tabs", r"\t")}


class CsvRow(NamedTuple):
    """One row of a CSV file, with its cells by column name."""

    file: str
    line: int
    cells: Mapping[str, str]

    def error(self, why: str) -> ConfigurationError:
        """Return an error whose message begins with the file and the line of this row."""
        return ConfigurationError(f"{self.file}, line {self.line}: {why}")

    def number(self, column: str) -> float:
        """Return the number in a column.

        Raises ConfigurationError if the cell is not a finite number, or exceeds `MAX_MAGNITUDE`.
        """
        cell = self.cells[column]
        try:
            value = math.nan if "_" in cell or not cell.isascii() else float(cell)  # as Python source
        except ValueError:
            value = math.nan
        if abs(value) <= MAX_MAGNITUDE:
            return value
        hint = f": {CSV_FORMAT_HINT}" if "," in cell else ""
        why = "too large" if abs(value) < math.inf else f"not a number{hint}"
        raise self.error(f"{column} = {cell!r} is {why}")


class CsvTable(NamedTuple):
    """CSV file: the column names, and an iterator over the rows. A row is parsed when it is read."""

    file: str
    names: tuple[str, ...]
    rows: Iterator[CsvRow]

    def require_columns(self, *alternatives: Sequence[str]) -> Sequence[str]:
        """Return the set of columns that the file contains completely, one of the alternatives.

        Raises ConfigurationError if the file contains none of these sets, or several of them.
        """
        found = [columns for columns in alternatives if set(columns) <= set(self.names)]
        if len(found) == 1:
            return found[0]
        if found:
            both = " and ".join(", ".join(columns) for columns in found)
            raise ConfigurationError(f"{self.file}: the columns {both} have the same meaning: keep one pair")
        wanted = " or ".join(", ".join(columns) for columns in alternatives)
        raise ConfigurationError(
            f"{self.file}: the first line must name the columns {wanted}, not {', '.join(self.names)}"
        )


@dataclass(frozen=True, slots=True)
class Points:
    """Columns of numbers. Row n of every column comes from line `lines[n]` of the file."""

    name: str
    sha256: str
    columns: dict[str, Numbers]
    lines: Sequence[int]

    def __len__(self) -> int:
        return len(self.lines)

    def __getitem__(self, column: str) -> Numbers:
        return self.columns[column]

    def error(self, why: str, row: int | None = None) -> ConfigurationError:
        """Return an error whose message begins with the file, and with the line if `row` is given."""
        location = self.name if row is None else f"{self.name}, line {self.lines[row]}"
        return ConfigurationError(f"{location}: {why}")

    def require_rows(self, count: int) -> None:
        """Raise ConfigurationError if there are fewer rows than `count`."""
        if len(self) < count:
            raise self.error(f"{counted(len(self), 'point')}, and at least {count} are needed")


def parse_table(content: bytes, file: str) -> CsvTable:
    """Return the table of a CSV text. Blank lines and lines that begin with # are skipped.

    Raises ConfigurationError if the text is not UTF-8, is empty, or has more than `MAX_ROWS` lines. Iteration
    over the rows raises ConfigurationError at the first invalid row.
    """
    if max(content.count(b"\n"), content.count(b"\r")) > MAX_ROWS:
        raise ConfigurationError(f"{file}: more than {MAX_ROWS} lines")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigurationError(f"{file}: not a text in UTF-8") from None
    lines = _split_lines(text, file)
    _, header = next(lines, (0, []))
    if not header:
        raise ConfigurationError(
            f"{file} is empty: name a file with the names of the columns and one line per row"
        )
    for separator, (name, in_sed) in _OTHER_SEPARATORS.items():
        if len(header) == 1 and separator in header[0]:
            raise ConfigurationError(
                f"{file}: the columns are separated by {name}: {CSV_FORMAT_HINT}; "
                f"sed 's/,/./g; s/{in_sed}/,/g' {file} prints the table in this form"
            )
    if repeated := next((name for name in header if header.count(name) > 1), ""):
        raise ConfigurationError(
            f"{file}: two columns have the name {repeated}: delete or rename one of them"
        )
    return CsvTable(file, tuple(header), _rows(lines, file, header))


def parse_points(
    content: bytes, name: str, alternatives: Sequence[Sequence[str]], optional: Sequence[str] = ()
) -> Points:
    """Return the numeric columns of a CSV text.

    The columns are the first set of `alternatives` that the file contains completely, and the columns of
    `optional` that the file contains. Raises ConfigurationError, with the line, if a cell or row is invalid.
    """
    table = parse_table(content, name)
    chosen = [
        *table.require_columns(*alternatives),
        *(column for column in optional if column in table.names),
    ]
    columns = {column: array("d") for column in chosen}
    lines = array("q")
    for row in table.rows:
        lines.append(row.line)
        for column, numbers in columns.items():
            numbers.append(row.number(column))
    import numpy as np  # takes 80 ms, and most commands read no table

    arrays = {column: np.array(numbers) for column, numbers in columns.items()}
    return Points(name, hashlib.sha256(content).hexdigest(), arrays, lines)


def _split_lines(text: str, file: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the stripped cells of each line that is neither blank nor a comment."""
    # A comment line is replaced by a blank line, so that the line numbers stay right.
    uncommented = ("\n" if line.lstrip().startswith("#") else line for line in io.StringIO(text, newline=""))
    reader = csv.reader(uncommented, strict=True)
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if any(stripped):
                yield reader.line_num, stripped
    except csv.Error as error:
        raise ConfigurationError(f"{file}, line {reader.line_num}: not CSV: {error}") from None


def _rows(lines: Iterator[tuple[int, list[str]]], file: str, header: list[str]) -> Iterator[CsvRow]:
    """Yield a row for each line. Raise ConfigurationError if its number of cells differs from the header."""
    for line, cells in lines:
        row = CsvRow(file, line, dict(zip(header, cells, strict=False)))
        if len(cells) != len(header):
            hint = f": {CSV_FORMAT_HINT}" if len(cells) > len(header) else ""
            raise row.error(f"{counted(len(cells), 'column')}, the header has {len(header)}{hint}")
        yield row
