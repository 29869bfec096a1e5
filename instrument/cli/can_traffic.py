"""What has come over CAN from the instrument: the latest of each frame, its age, and lost Force frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from instrument.cli.observe import Rate
from instrument.cli.showing import with_unit
from instrument.faults import name_of
from registers.can.frames import EMERGENCY, FORCE, FRAMES, HEARTBEAT, RIG_ERROR, Frame

PERIODS_LATE, LEAST_LATE_S = 3, 1.5  #: a Force rate of 1 Hz can be configured, and is not late
_BY_NAME = {frame.name: frame for frame in FRAMES}
_FIELDS = {frame.name: {field.name: field for field in frame.fields} for frame in FRAMES}


@dataclass(slots=True)
class Heard:
    """One kind of frame: the latest, and how often it comes."""

    frame: Frame
    values: dict[str, Any] = field(default_factory=dict)
    at_s: float = 0.0
    rate: Rate = field(default_factory=Rate)

    def late(self, now_s: float) -> bool:
        """Whether the next one should have come long ago; what comes at events only is never late."""
        wait_s = max(PERIODS_LATE * self.frame.period_s, LEAST_LATE_S)
        return self.frame.period_s > 0 and now_s - self.at_s > wait_s


@dataclass(slots=True)
class Traffic:
    """All kinds of frames."""

    kinds: dict[str, Heard] = field(default_factory=dict)
    lost: int = 0  #: Force frames, by their counter
    _counter: int | None = None

    def note(self, name: str, values: dict[str, Any], now_s: float) -> int:
        """Take over a frame; the number of Force frames that were lost before it."""
        heard = self.kinds.setdefault(name, Heard(_BY_NAME[name]))
        heard.values, heard.at_s = values, now_s
        heard.rate.note(now_s)
        if name == HEARTBEAT.name and values["node_state"] == "boot_up":
            self._counter = None  # a new start counts anew
        lost = self._gap(values["counter"]) if name == FORCE.name else 0
        self.lost += lost
        return lost

    def _gap(self, counter: int) -> int:
        before, self._counter = self._counter, counter
        return 0 if before in (None, counter) else (counter - before - 1) & 0xFF

    def table(self, now_s: float) -> Table:
        """All of it, with ages at `now_s`."""
        table = Table("frame", "per s", "age", "lost", "signal", "value", box=SIMPLE_HEAD)
        for name, heard in self.kinds.items():
            age = f"{now_s - heard.at_s:.2f} s"
            heading = [
                name,
                str(heard.rate.per_s(now_s)),
                f"[bold red]{age}[/]" if heard.late(now_s) else age,
                str(self.lost) if name == FORCE.name else "",
            ]
            for row in signals(name, heard.values):
                table.add_row(*heading, *row)
                heading = [""] * len(heading)
        return table


def signals(name: str, values: dict[str, Any]) -> list[tuple[str, str]]:
    """Name and value of each signal of a frame, for people."""
    return [(signal, _told(name, signal, value)) for signal, value in values.items()]


def _told(name: str, signal: str, value: Any) -> str:
    if name == EMERGENCY.name and signal == "error_code":
        return _error(value)
    return with_unit(_FIELDS[name][signal], value)


def _error(code: int) -> str:
    """FF20h lease expired; what is not the rig's has a code of CiA 301 alone."""
    return f"{code:04X}h" + (f" {name_of(code - RIG_ERROR)}" if code > RIG_ERROR else "")
