"""Status of the CAN frames of an instrument: latest frame of each kind, ages, number of lost Force frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from pneuforce.instrument.cli.terminal.output import format_value
from pneuforce.instrument.core.faults import name_of
from pneuforce.registers.can.frames import EMERGENCY, FORCE, FRAMES, HEARTBEAT, RIG_ERROR, FrameDefinition
from pneuforce.teststand.observer import EventRate

#: A frame is late after 3 default periods, but not before 1.5 s, because the Force rate may be set to 1 Hz.
LATE_PERIODS, MIN_LATE_S = 3, 1.5
_BY_NAME = {frame.name: frame for frame in FRAMES}
_FIELDS = {frame.name: {field.name: field for field in frame.fields} for frame in FRAMES}


@dataclass(slots=True)
class FrameStatus:
    """Latest values and rate of one kind of frame."""

    definition: FrameDefinition
    values: dict[str, Any] = field(default_factory=dict)
    received_s: float = 0.0
    rate: EventRate = field(default_factory=EventRate)

    def is_late(self, now_s: float) -> bool:
        """Return True if the next frame is overdue. A frame without a period is never late."""
        limit_s = max(LATE_PERIODS * self.definition.period_s, MIN_LATE_S)
        return self.definition.period_s > 0 and now_s - self.received_s > limit_s


@dataclass(slots=True)
class CanTraffic:
    """Status of all kinds of frames."""

    kinds: dict[str, FrameStatus] = field(default_factory=dict)
    lost: int = 0  #: number of lost Force frames, computed from the counter in these frames
    _counter: int | None = None

    def add(self, name: str, values: dict[str, Any], now_s: float) -> int:
        """Add a received frame. Return the number of Force frames that were lost before this frame."""
        status = self.kinds.setdefault(name, FrameStatus(_BY_NAME[name]))
        status.values, status.received_s = values, now_s
        status.rate.add(now_s)
        if name == HEARTBEAT.name and values["node_state"] == "boot_up":
            self._counter = None  # a restarted instrument counts its Force frames from the beginning
        lost = self._gap(values["counter"]) if name == FORCE.name else 0
        self.lost += lost
        return lost

    def _gap(self, counter: int) -> int:
        before, self._counter = self._counter, counter
        return 0 if before in (None, counter) else (counter - before - 1) & 0xFF

    def table(self, now_s: float) -> Table:
        """Return a table of all frames, with their ages at `now_s`."""
        table = Table("frame", "per s", "age", "lost", "signal", "value", box=SIMPLE_HEAD)
        for name, status in self.kinds.items():
            age = f"{now_s - status.received_s:.2f} s"
            heading = [
                name,
                str(status.rate.per_s(now_s)),
                f"[bold red]{age}[/]" if status.is_late(now_s) else age,
                str(self.lost) if name == FORCE.name else "",
            ]
            for row in format_signals(name, status.values):
                table.add_row(*heading, *row)
                heading = [""] * len(heading)
        return table


def format_signals(name: str, values: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the name and the text of each signal of a frame."""
    return [(signal, _format_signal(name, signal, value)) for signal, value in values.items()]


def _format_signal(name: str, signal: str, value: Any) -> str:
    if name == EMERGENCY.name and signal == "error_code":
        return _format_error(value)
    return format_value(_FIELDS[name][signal], value)


def _format_error(code: int) -> str:
    """Return an error code with the name of its fault, for example "FF20h lease expired".

    Codes that do not come from the rig are codes of CiA 301 and have no fault name.
    """
    return f"{code:04X}h" + (f" {name_of(code - RIG_ERROR)}" if code > RIG_ERROR else "")
