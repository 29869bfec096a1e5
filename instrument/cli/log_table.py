"""`pneuforce log`: print the records of an event log as a table or as lines of JSON, or verify them."""

from __future__ import annotations

import json
import re
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.reading import LOWEST, DamagedLogError, NotAnEventLogError, open_event_log
from pneuforce.instrument.audit.verification import (
    BrokenChainError,
    StoredRecord,
    record_time,
    verify_chain,
)
from pneuforce.instrument.audit.wording import describe_record

FOLLOW_PERIOD_S = 0.5
HEAD_PATTERN = re.compile(r"[0-9a-f]{64}")
COLUMN_WIDTHS = {"number": 7, "time (UTC)": 26, "who": 24, "result": 16}
PIPED_WIDTH = 200  #: width of the table if stdout is not a terminal
COLOURS = {"accepted": "green", "done": "green"}


class EventSelection(NamedTuple):
    """Selection of records."""

    last: int = 0  #: number of latest records to show; 0 selects all records
    since: datetime | None = None
    follow: bool = False


def show_events(path: Path, selection: EventSelection, as_json: bool) -> None:
    """Print the selected records. Raises ConfigurationError if the log is missing or cannot be read."""
    show = _print_lines if as_json else _table_printer()
    with suppress(KeyboardInterrupt):
        rows = _read(path, selection)
        show(rows)
        while selection.follow:
            time.sleep(FOLLOW_PERIOD_S)
            first = rows[-1].number + 1 if rows else LOWEST
            added = _read(path, EventSelection(), first)
            if added:
                show(added)
                rows = added


def _read(path: Path, selection: EventSelection, first: int = LOWEST) -> list[StoredRecord]:
    """Return the selected records from the number `first` on. Raises ConfigurationError."""
    since = selection.since
    if since and since.tzinfo:
        since = since.astimezone(UTC)
    from_time = since.isoformat() if since else ""
    try:
        with open_event_log(path, first) as rows:
            selected = (row for row in rows if not from_time or record_time(row.body) >= from_time)
            return list(deque(selected, selection.last or None))
    except DamagedLogError as error:
        is_log = not isinstance(error, NotAnEventLogError)
        hint = "; pneuforce log verify shows how many records are intact" if is_log else ""
        raise ConfigurationError(f"{error}{hint}") from None


def verify_events(path: Path, head: str | None, as_json: bool) -> int:
    """Verify the chain of digests and print the result. Return the exit code, 1 for a broken chain.

    Raises ConfigurationError if `head` is not a digest.
    """
    if head is not None and not HEAD_PATTERN.fullmatch(head.lower()):
        raise ConfigurationError(
            f"--head {head} is invalid: a head has 64 hexadecimal digits, as verify prints"
        )
    try:
        with open_event_log(path) as rows:
            chain = verify_chain(rows, head.lower() if head else None)
        if not chain.records:
            raise BrokenChainError(
                "it contains no record: was the log moved or copied without the file that ends in -wal?"
            )
    except (BrokenChainError, DamagedLogError) as error:
        result = {"file": str(path), "good": False, "why": str(error)}
        print(json.dumps(result) if as_json else f"{path}: NOT GOOD: {error}")
        return 1
    if as_json:
        print(json.dumps({"file": str(path), "good": True, **chain._asdict()}))
        return 0
    head_text = ", including the noted head" if head else ""
    print(
        f"{chain.records} records from {chain.first_at} to {chain.last_at}, unbroken{head_text}, "
        f"head {chain.head}"
    )
    return 0


# ---- formatting


def _print_lines(rows: Iterable[StoredRecord]) -> None:
    for row in rows:
        fields = _fields_of(row.body)
        print(json.dumps({"number": row.number, **fields, "digest": _hex(row.digest)}, ensure_ascii=False))
    sys.stdout.flush()


def _table_printer() -> Callable[[Iterable[StoredRecord]], None]:
    """Return a function that prints rows as a table. Only its first call prints the column headings."""
    console = Console(width=None if sys.stdout.isatty() else PIPED_WIDTH)
    headings = iter((True,))

    def show(rows: Iterable[StoredRecord]) -> None:
        table = Table(box=None, show_header=next(headings, False), pad_edge=False)
        for name, width in COLUMN_WIDTHS.items():
            table.add_column(name, width=width, overflow="fold")
        table.add_column("what", overflow="fold", ratio=1)
        for row in rows:
            table.add_row(str(row.number), *_cells(_fields_of(row.body)))
        console.print(table)

    return show


def _cells(fields: Mapping[str, Any]) -> Iterator[Text]:
    result = str(fields.get("result", ""))
    at = str(fields.get("at", "")).replace("T", " ").removesuffix("Z")
    yield Text(at)
    yield Text(str(fields.get("who", "")))
    yield Text(result, style=COLOURS.get(result, "yellow"))
    yield Text(describe_record(fields))


def _fields_of(body: Any) -> dict[str, Any]:
    """Return the fields of a record. The body of a damaged record is returned as text."""
    with suppress(ValueError, TypeError, RecursionError):
        fields = json.loads(body)
        if isinstance(fields, dict):
            return fields
    return {"unreadable": repr(body)}


def _hex(digest: Any) -> str:
    return digest.hex() if isinstance(digest, bytes) else repr(digest)
