"""`pneuforce log`: the records of an event log as a table, as lines of JSON, or verified."""

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

from instrument.errors import ConfigurationError
from instrument.events.reading import LOWEST, Damaged, NoLog, opened
from instrument.events.verification import Broken, Row, moment_of, verified
from instrument.events.words import in_words

FOLLOW_S = 0.5
HEAD = re.compile(r"[0-9a-f]{64}")
WIDTHS = {"number": 7, "time (UTC)": 26, "who": 24, "verdict": 16}
PIPED_WIDTH = 200
COLOURS = {"accepted": "green", "done": "green"}


class Choice(NamedTuple):
    """Which records."""

    last: int = 0  #: 0 for all
    since: datetime | None = None
    follow: bool = False


def show_events(path: Path, choice: Choice, as_json: bool) -> None:
    """Print records. Raises ConfigurationError where there is no such log or it cannot be read on."""
    show = _print_lines if as_json else _table_printer()
    with suppress(KeyboardInterrupt):
        rows = _read(path, choice)
        show(rows)
        while choice.follow:
            time.sleep(FOLLOW_S)
            first = rows[-1].number + 1 if rows else LOWEST
            added = _read(path, Choice(), first)
            if added:
                show(added)
                rows = added


def _read(path: Path, choice: Choice, first: int = LOWEST) -> list[Row]:
    since = choice.since.astimezone(UTC) if choice.since and choice.since.tzinfo else choice.since
    from_ = since.isoformat() if since else ""
    try:
        with opened(path, first) as rows:
            chosen = (row for row in rows if not from_ or moment_of(row.body) >= from_)
            return list(deque(chosen, choice.last or None))
    except Damaged as error:
        hint = "" if isinstance(error, NoLog) else "; pneuforce log verify says how much of it is good"
        raise ConfigurationError(f"{error}{hint}") from None


def verify_events(path: Path, head: str | None, as_json: bool) -> int:
    """Say whether the chain is unbroken; exit code 1 where it is not. Raises ConfigurationError."""
    if head is not None and not HEAD.fullmatch(head.lower()):
        raise ConfigurationError(f"--head {head}: a head is 64 hexadecimal digits, as verify prints them")
    try:
        with opened(path) as rows:
            chain = verified(rows, head.lower() if head else None)
        if not chain.records:
            raise Broken("it holds no record; was it moved, or copied, without what lies beside it as -wal?")
    except (Broken, Damaged) as wrong:
        bad = {"file": str(path), "good": False, "why": str(wrong)}
        print(json.dumps(bad) if as_json else f"{path}: NOT GOOD: {wrong}")
        return 1
    if as_json:
        print(json.dumps({"file": str(path), "good": True, **chain._asdict()}))
        return 0
    span = f" from {chain.first_at} to {chain.last_at}"
    kept = ", the noted head among them" if head else ""
    print(f"{chain.records} records{span}, unbroken{kept}, head {chain.head}")
    return 0


# ---- in words


def _print_lines(rows: Iterable[Row]) -> None:
    for row in rows:
        facts = _facts_of(row.body)
        print(json.dumps({"number": row.number, **facts, "seal": _hex(row.seal)}, ensure_ascii=False))
    sys.stdout.flush()


def _table_printer() -> Callable[[Iterable[Row]], None]:
    """What prints rows as a table; what is added later goes on in the same columns, without a new head."""
    console = Console(width=None if sys.stdout.isatty() else PIPED_WIDTH)
    heads = iter((True,))

    def show(rows: Iterable[Row]) -> None:
        table = Table(box=None, show_header=next(heads, False), pad_edge=False)
        for name, width in WIDTHS.items():
            table.add_column(name, width=width, overflow="fold")
        table.add_column("what", overflow="fold", ratio=1)
        for row in rows:
            table.add_row(str(row.number), *_cells(_facts_of(row.body)))
        console.print(table)

    return show


def _cells(facts: Mapping[str, Any]) -> Iterator[Text]:
    verdict = str(facts.get("verdict", ""))
    at = str(facts.get("at", "")).replace("T", " ").removesuffix("Z")
    yield Text(at)
    yield Text(str(facts.get("who", "")))
    yield Text(verdict, style=COLOURS.get(verdict, "yellow"))
    yield Text(in_words(facts))


def _facts_of(body: Any) -> dict[str, Any]:
    with suppress(ValueError, TypeError, RecursionError):
        facts = json.loads(body)
        if isinstance(facts, dict):
            return facts
    return {"unreadable": repr(body)}


def _hex(seal: Any) -> str:
    return seal.hex() if isinstance(seal, bytes) else repr(seal)
