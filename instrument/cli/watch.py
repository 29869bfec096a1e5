"""`pneuforce watch`: a client that shows what a PLC or a robot controller would see.

On a terminal it is a table that lives; elsewhere, lines: of what has changed, or JSON of everything.
"""

from __future__ import annotations

import json
import math
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from threading import Event, Timer
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.live import Live
from rich.table import Table

from instrument.cli.observe import NodeAt, Rate, can_frames
from instrument.errors import FaceError
from registers.can.frames import FRAMES
from registers.field import Field, plain_unit
from registers.map import BY_NAME, Register
from registers.modbus.client import Plc, PlcError

POLL_S = 0.5
REDRAW_S = 0.2
HINT = "is an instrument running there? (pneuforce demo starts one)"
SIDES = (range(36), range(512, 544))  #: what is measured, what is asked; without the scaled mirrors
FIELDS = {frame.name: {field.name: field for field in frame.fields} for frame in FRAMES}


def watch_modbus(connect: Callable[[], Plc], seconds: float | None, as_json: bool) -> None:
    """Poll the registers twice a second. Raises FaceError where nobody answers."""
    stop = _stop_after(seconds)
    try:
        with connect() as plc, _shower(as_json, _lines_of_registers(), _register_table) as show:
            while True:
                show(plc.read())
                if stop.wait(POLL_S):
                    return
    except PlcError as error:
        raise FaceError(f"{error}; {HINT}") from None


def _lines_of_registers() -> Callable[[dict[str, Any]], str]:
    shown: dict[str, str] = {}

    def line(values: dict[str, Any]) -> str:
        texts = {
            name: _on_the_wire(BY_NAME[name], value)
            for name, value in values.items()
            if any(BY_NAME[name].address in side for side in SIDES)
        }
        changed = [f"{name} {text}" for name, text in texts.items() if text != shown.get(name)]
        shown.update(texts)
        return f"{time.strftime('%H:%M:%S')}  " + "  ".join(changed)

    return line


def _register_table(values: dict[str, Any]) -> Table:
    """What is measured on the left, what is asked on the right."""
    sides = Table.grid(padding=(0, 2))
    sides.add_row(*(_side(values, side) for side in SIDES))
    return sides


def _side(values: dict[str, Any], addresses: range) -> Table:
    table = Table.grid(padding=(0, 2))
    for name, value in values.items():
        register = BY_NAME[name]
        if register.address in addresses:
            table.add_row(str(register.address), name, _on_the_wire(register, value))
    return table


@dataclass(slots=True)
class Traffic:
    """The latest frame of each name, and how often they come."""

    latest: dict[str, dict[str, Any]] = field(default_factory=dict)
    rates: dict[str, Rate] = field(default_factory=dict)
    drawn_s: float = -math.inf

    def note(self, name: str, values: dict[str, Any]) -> bool:
        """Take over a frame; True where it is time to draw again."""
        now_s = time.monotonic()
        self.latest[name] = values
        self.rates.setdefault(name, Rate()).note(now_s)
        if now_s < self.drawn_s + REDRAW_S:
            return False
        self.drawn_s = now_s
        return True

    def table(self) -> Table:
        """All of it."""
        table = Table("frame", "per s", "signal", "value", box=SIMPLE_HEAD)
        for name, values in self.latest.items():
            heading = (name, str(self.rates[name].per_s(time.monotonic())))
            for signal_name, value in values.items():
                table.add_row(*heading, signal_name, _with_unit(FIELDS[name][signal_name], value))
                heading = ("", "")
        return table


def watch_can(node: NodeAt, seconds: float | None, as_json: bool) -> None:
    """Show every frame of the instrument, decoded. Raises FaceError where there is no bus."""
    stop = _stop_after(seconds)
    traffic = Traffic()
    try:
        with _shower(as_json, _line_of_frame, lambda _: traffic.table()) as show:
            for t_s, name, values in _until(stop, can_frames(node, stop)):
                if traffic.note(name, values) or as_json or not sys.stdout.isatty():
                    show({"t_s": t_s, "frame": name, "values": values})
    except BrokenPipeError:
        raise
    except OSError as error:
        raise FaceError(f"{error}; {HINT}") from None


def _line_of_frame(seen: dict[str, Any]) -> str:
    fields = FIELDS[seen["frame"]]
    signals = "  ".join(f"{name} {_with_unit(fields[name], value)}" for name, value in seen["values"].items())
    return f"{seen['t_s']:.4f}  {seen['frame']:<9}  {signals}"


@contextmanager
def _shower(
    as_json: bool, line: Callable[[dict[str, Any]], str], table: Callable[[dict[str, Any]], Table]
) -> Iterator[Callable[[dict[str, Any]], None]]:
    """How to show what was seen: JSON, a table that lives, or a line."""
    if as_json:
        yield lambda seen: _print(json.dumps(_plain(seen)))
    elif sys.stdout.isatty():
        with Live(auto_refresh=False) as live:
            yield lambda seen: live.update(table(seen), refresh=True)
    else:
        yield lambda seen: _print(line(seen))


def _until(stop: Event, frames: Iterator[tuple[float, str, dict[str, Any]]]) -> Iterator[Any]:
    for frame in frames:
        if stop.is_set():
            return
        yield frame


def _stop_after(seconds: float | None) -> Event:
    stop = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    if seconds is not None:
        timer = Timer(seconds, stop.set)
        timer.daemon = True
        timer.start()
    return stop


def _plain(value: Any) -> Any:
    """A value that JSON knows: null where it is not available."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, frozenset):
        return sorted(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _with_unit(declared: Field, value: Any) -> str:
    """A value for a person, in the unit of its quantity, as the DBC gives it."""
    if isinstance(value, frozenset):
        return ", ".join(sorted(value)) or "none"
    if not isinstance(value, float):
        return str(value)
    return f"{value:.3f} {plain_unit(declared.unit)}" if math.isfinite(value) else "not available"


def _on_the_wire(register: Register, value: Any) -> str:
    """A value for a person, in the unit of its register, as a PLC sees it."""
    if not register.unit or not math.isfinite(value):
        return _with_unit(register, value)
    code = register.encode(value)
    return f"{code} {register.unit}" if isinstance(code, int) else f"{code:.3f} {register.unit}"


def _print(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()
