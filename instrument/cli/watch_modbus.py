"""`pneuforce watch modbus`: what a PLC sees, in the units of its registers."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.live import Live
from rich.table import Table

from instrument.cli.showing import HINT, as_json, say, stop_after, with_unit
from instrument.errors import FaceError
from registers.map import BY_NAME, Register
from registers.modbus.client import Plc, PlcError, PortError

POLL_S = 0.5
SIDES = (range(36), range(512, 544))  #: what is measured, what is asked; without the scaled mirrors


def watch_modbus(
    connect: Callable[[], Plc], seconds: float | None, json_lines: bool, hint: str = HINT
) -> None:
    """Poll the registers twice a second. Raises FaceError, with the hint, where nobody answers."""
    stop = stop_after(seconds)
    try:
        with connect() as plc, _shower(json_lines, _lines_of_registers(), _register_table) as show:
            while True:
                show(plc.read())
                if stop.wait(POLL_S):
                    return
    except PortError as error:
        raise FaceError(str(error)) from None
    except PlcError as error:
        raise FaceError(f"{error}; {hint}") from None


@contextmanager
def _shower(
    json_lines: bool, line: Callable[[dict[str, Any]], str], table: Callable[[dict[str, Any]], Table]
) -> Iterator[Callable[[dict[str, Any]], None]]:
    """How to show what was seen: JSON, a table that lives, or a line."""
    if json_lines:
        yield lambda seen: say(as_json(seen))
    elif sys.stdout.isatty():
        with Live(auto_refresh=False) as live:
            yield lambda seen: live.update(table(seen), refresh=True)
    else:
        yield lambda seen: say(line(seen))


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


def _on_the_wire(register: Register, value: Any) -> str:
    """A value for a person, in the unit of its register, as a PLC sees it."""
    if not register.unit or not math.isfinite(value):
        return with_unit(register, value)
    code = register.encode(value)
    return f"{code} {register.unit}" if isinstance(code, int) else f"{code:.3f} {register.unit}"
