"""What the instrument does by itself that deserves a record: the differences between two looks at it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from instrument.events.record import Facts
from instrument.faults import name_of
from instrument.rig.frames import BoardKind


class Seen(NamedTuple):
    """One look; the names are those of the records."""

    board: tuple[int, int, int] | None  #: kind, serial number, firmware
    faults: tuple[int, ...]
    state: str
    zero_kpa: float | None
    force_alarm: bool


def changes(was: Seen, now: Seen) -> list[Facts]:
    """Facts of what has changed, causes before effects."""
    return [
        {"kind": name, "was": _said(name, before), "is": _said(name, after)}
        for name, before, after in zip(Seen._fields, was, now, strict=True)
        if before != after
    ]


def _board_in_words(board: tuple[int, int, int] | None) -> str | None:
    if board is None:
        return None
    kind, serial, firmware = board
    known = BoardKind(kind).name.lower() if kind in set(BoardKind) else f"of kind {kind}"
    return f"{known}, serial {serial}, firmware {firmware >> 8}.{firmware & 0xFF}"


#: How a record says what is not a word already.
_WORDS: Mapping[str, Callable[[Any], Any]] = {
    "board": _board_in_words,
    "faults": lambda codes: [name_of(code) for code in codes],
}


def _said(name: str, value: Any) -> Any:
    return _WORDS[name](value) if name in _WORDS else value
