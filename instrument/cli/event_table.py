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


def in_words(facts: Mapping[str, Any]) -> str:
    """What happened, in one line, without when, who and the verdict."""
    kind = str(facts.get("kind", ""))
    tell = _WORDS.get(kind)
    with suppress(KeyError, TypeError, ValueError, AttributeError):  # a record that was altered
        if tell is not None:
            return tell(facts)
        if "was" in facts:
            return f"{kind}: {_value(facts['was'])} → {_value(facts['is'])}"
    told = {name: fact for name, fact in facts.items() if name not in _TOLD_ELSEWHERE}
    return ": ".join(filter(None, (kind, ", ".join(f"{name} {_value(fact)}" for name, fact in told.items()))))


def _write_in_words(facts: Mapping[str, Any]) -> str:
    parts = (
        f"{name} {_value(new)}" if old == new else f"{name} {_value(old)} → {_value(new)}"
        for name, (old, new) in facts["values"].items()
    )
    return ", ".join(parts) + (" (vented all the same)" if facts.get("vented") else "")


def _times_in_words(how: Callable[[int], str]) -> Callable[[Mapping[str, Any]], str]:
    def words(facts: Mapping[str, Any]) -> str:
        of = facts["of"]
        verdict = f": {of['verdict']}" if "verdict" in of else ""
        span = f"{facts['since'][:19]} to {facts['until'][:19]}".replace("T", " ")
        return f"{how(facts['times'])} ({span}): {in_words(of)}{verdict}"

    return words


_TOLD_ELSEWHERE = {"at", "mono_s", "who", "verdict", "kind"}
#: How the kinds of record are told that have words of their own.
_WORDS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "write": _write_in_words,
    "request": lambda facts: f"request {facts['request']}",
    "stop": lambda facts: f"stop: {facts['why']}",
    "answer": lambda facts: f"command {facts['command']}",
    "repeated": _times_in_words(lambda times: "repeated once" if times == 1 else f"repeated {times} times"),
    "held_back": _times_in_words(lambda times: f"{times} more, too many to keep each; the last"),
    "lost": _times_in_words(lambda times: f"{times} records lost, the disk did not take them; the first"),
}


def _value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return " + ".join(map(str, value)) or "none"
    return {"None": "none", "True": "yes", "False": "no"}.get(str(value), str(value))


def _facts_of(body: Any) -> dict[str, Any]:
    with suppress(ValueError, TypeError):
        facts = json.loads(body)
        if isinstance(facts, dict):
            return facts
    return {"unreadable": repr(body)}


def _hex(seal: Any) -> str:
    return seal.hex() if isinstance(seal, bytes) else repr(seal)
