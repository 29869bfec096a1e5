"""`pneuforce log show`: print the records of an event log as a table, as CSV or as lines of JSON."""

from __future__ import annotations

import csv
import io
import json
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple, TypeVar

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.reading import (
    LOWEST,
    DamagedLogError,
    NotAnEventLogError,
    open_event_log,
    repeated_if_changed,
)
from pneuforce.instrument.audit.verification import StoredRecord, record_time
from pneuforce.instrument.audit.wording import describe_record
from pneuforce.instrument.cli.terminal.output import json_text, print_text
from pneuforce.support.printable import printable

FOLLOW_PERIOD_S = 0.5
COLUMN_WIDTHS = {"number": 7, "time (UTC)": 26, "who": 24, "result": 16}
NESTED_BYTES = 100  #: shown bytes of a record that is nested too deeply
PIPED_WIDTH = 200  #: width of the table if stdout is not a terminal
PIPED_COLUMN_WIDTHS = COLUMN_WIDTHS | {"result": 28}  #: wide enough for each result in one line
#: On a narrower terminal, a record has two lines: these columns without fractions of a second, then *what*.
MIN_WIDTH = 120
NARROW_COLUMN_WIDTHS = {"number": 7, "time (UTC)": 19, "who": 23, "result": 23}
COLOURS = {"accepted": "green", "done": "green"}
#: Kinds of records whose result is a reject reason, unless the request was executed.
REJECTABLE = ("write", "request", "answer")

#: Columns of the CSV. All columns except *number*, *kind* and *digest* have the content of the table.
CSV_COLUMNS = ("number", "at", "who", "kind", "result", "what", "digest")

Shown = TypeVar("Shown")
Printer = Callable[[Sequence[StoredRecord]], None]


class EventSelection(NamedTuple):
    """Selection of records."""

    last: int = 0  #: number of latest records to show; 0 selects all records
    since: datetime | None = None
    follow: bool = False


def show_events(path: Path, selection: EventSelection, as_json: bool, as_csv: bool = False) -> None:
    """Print the selected records.

    Raises ConfigurationError if the log is missing or is not an event log. If the log is damaged, the error
    follows the records before the damage.
    """
    show = _print_lines if as_json else _csv_printer() if as_csv else _table_printer()
    with suppress(KeyboardInterrupt):
        rows = _print_selected(path, selection, LOWEST, show)
        if not rows and not selection.follow:
            limit = f" since {selection.since} UTC" if selection.since else ""
            print(f"pneuforce: {printable(str(path))} contains no record{limit}", file=sys.stderr)
        while selection.follow:
            time.sleep(FOLLOW_PERIOD_S)
            first = rows[-1].number + 1 if rows and isinstance(rows[-1].number, int) else LOWEST
            show_added = partial(_if_any, show)
            rows = _print_selected(path, EventSelection(), first, show_added) or rows


def _if_any(show: Printer, rows: Sequence[StoredRecord]) -> None:
    if rows:
        show(rows)


def _print_selected(
    path: Path, selection: EventSelection, first: int, show: Printer
) -> Sequence[StoredRecord]:
    """Print and return the selected records from the number `first` on. Raises ConfigurationError."""
    since = selection.since
    if since and since.tzinfo:
        since = since.astimezone(UTC)
    from_time = since.isoformat() if since else ""
    selected: deque[StoredRecord] = deque(maxlen=selection.last or None)
    try:
        repeated_if_changed(path, partial(_select, path, from_time, first, selected))
    except NotAnEventLogError as error:
        raise ConfigurationError(str(error)) from None
    except DamagedLogError as error:
        _if_any(show, selected)
        raise ConfigurationError(
            f"{error}. The records after the damage are not shown; pneuforce log verify --file "
            f"{quote(str(path))} shows how many records are intact"
        ) from None
    show(selected)
    return selected


def _select(path: Path, from_time: str, first: int, selected: deque[StoredRecord]) -> None:
    """Read the records from the number `first` on into `selected`, also those before a damage."""
    selected.clear()
    with open_event_log(path, first) as rows:
        selected.extend(row for row in rows if not from_time or record_time(row.body) >= from_time)


# ---- formatting


def _print_lines(rows: Iterable[StoredRecord]) -> None:
    for row in rows:
        print_text(_shown(row.body, partial(_json_line, row)))


def _json_line(row: StoredRecord, fields: Mapping[str, Any]) -> str:
    number = row.number if isinstance(row.number, int) else repr(row.number)
    return json_text({"number": number, **fields, "digest": _hex(row.digest)})


def _shown(body: Any, format_fields: Callable[[Mapping[str, Any]], Shown]) -> Shown:
    """Return the formatted fields of a record. A record that is nested too deeply is shown as unreadable."""
    try:
        return format_fields(_fields_of(body))
    except RecursionError:
        return format_fields({"unreadable": f"{body[:NESTED_BYTES]!r}…"})


def _csv_printer() -> Printer:
    """Return a function that prints rows as CSV. Only its first call prints the names of the columns."""
    header = [CSV_COLUMNS]

    def show(rows: Sequence[StoredRecord]) -> None:
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerows(header)
        header.clear()
        for row in rows:
            cells = (str(row.number), *_shown(row.body, _csv_cells), _hex(row.digest))
            table.writerow(map(printable, cells))
        print(text.getvalue(), end="", flush=True)

    return show


def _csv_cells(fields: Mapping[str, Any]) -> list[str]:
    at, who, kind = (str(fields.get(name, "")) for name in ("at", "who", "kind"))
    return [at, who, kind, _result_of(fields), describe_record(fields)]


def _table_printer() -> Printer:
    """Return a function that prints rows as a table. Only its first call prints the column headings."""
    is_terminal = sys.stdout.isatty()
    console = Console(width=None if is_terminal else PIPED_WIDTH)
    headings = iter((True,))
    if console.width < MIN_WIDTH:
        return lambda rows: _print_in_two_lines(console, rows, next(headings, False))
    widths = COLUMN_WIDTHS if is_terminal else PIPED_COLUMN_WIDTHS

    def show(rows: Sequence[StoredRecord]) -> None:
        table = _table(widths, next(headings, False))
        table.add_column("what", overflow="fold", ratio=1)
        for row in rows:
            table.add_row(Text(printable(str(row.number))), *_shown(row.body, _cells))
        console.print(table)

    return show


def _table(widths: Mapping[str, int], show_header: bool) -> Table:
    table = Table(box=None, show_header=show_header, pad_edge=False)
    for name, width in widths.items():
        table.add_column(name, width=width, overflow="fold")
    return table


def _print_in_two_lines(console: Console, rows: Iterable[StoredRecord], show_header: bool) -> None:
    """Print each record as a row of a table, and its text in the lines below."""
    for row in rows:
        at, who, result, what = _shown(row.body, _cells)
        table = _table(NARROW_COLUMN_WIDTHS, show_header)
        show_header = False
        at.truncate(NARROW_COLUMN_WIDTHS["time (UTC)"])
        table.add_row(Text(printable(str(row.number))), at, who, result)
        console.print(table, Padding(what, (0, 0, 0, NARROW_COLUMN_WIDTHS["number"] + 2)))


def _cells(fields: Mapping[str, Any]) -> list[Text]:
    result = _result_of(fields)
    at = str(fields.get("at", "")).replace("T", " ").removesuffix("Z")
    texts = (at, str(fields.get("who", "")), result, describe_record(fields))
    styles = ("", "", COLOURS.get(result, "yellow"), "")
    return [Text(printable(text), style) for text, style in zip(texts, styles, strict=True)]


def _result_of(fields: Mapping[str, Any]) -> str:
    """Return the result of a request. A reject reason such as "state" is not understood without its kind."""
    result = str(fields.get("result", ""))
    is_rejected = fields.get("kind") in REJECTABLE and result not in (*COLOURS, "", "vented")
    return f"rejected: {result}" if is_rejected else result


def _fields_of(body: Any) -> dict[str, Any]:
    """Return the fields of a record. The body of a damaged record is returned as text."""
    with suppress(ValueError, TypeError, RecursionError):
        fields = json.loads(body)
        if isinstance(fields, dict):
            return fields
    return {"unreadable": repr(body)}


def _hex(digest: Any) -> str:
    return digest.hex() if isinstance(digest, bytes) else repr(digest)
