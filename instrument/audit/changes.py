"""Changes of the instrument's state that are logged, for example a new fault."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from pneuforce.instrument.audit.record import RecordFields
from pneuforce.instrument.core.faults import described
from pneuforce.protocol.frames import BoardKind


class ObservedState(NamedTuple):
    """State of the instrument at one instant. A change of a field is logged as a record of this kind."""

    board: tuple[int, int, str] | None  #: kind of the board, serial number, description of the firmware
    faults: tuple[int, ...]
    state: str
    zero_kpa: float | None
    force_alarm: bool
    force_alarm_2: bool


def changes(before: ObservedState, now: ObservedState) -> list[RecordFields]:
    """Return the fields of one record for each change. A cause, for example a fault, precedes its effects."""
    return [
        {"kind": name, "was": _formatted(name, old), "is": _formatted(name, new)}
        for name, old, new in zip(ObservedState._fields, before, now, strict=True)
        if old != new
    ]


def _format_board(board: tuple[int, int, str] | None) -> str | None:
    if board is None:
        return None
    code, serial, firmware = board
    kind = BoardKind(code).name.lower() if code in set(BoardKind) else f"of kind {code}"
    return f"{kind}, serial {serial}, {firmware}"


#: Formatters of the fields that contain numeric codes.
_FORMATTERS: Mapping[str, Callable[[Any], Any]] = {
    "board": _format_board,
    "faults": lambda codes: [described(code) for code in codes],
}


def _formatted(name: str, value: Any) -> Any:
    return _FORMATTERS[name](value) if name in _FORMATTERS else value
