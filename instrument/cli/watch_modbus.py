"""`pneuforce watch modbus`: show the registers as a PLC reads them."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from typing import Any

from rich.live import Live
from rich.table import Table

from pneuforce.client.address import modbus_opener
from pneuforce.errors import ServerError
from pneuforce.instrument.cli.output import (
    CONNECTION_HINT,
    format_value,
    json_line,
    print_line,
    stop_after,
)
from pneuforce.registers.map import BY_NAME, Register
from pneuforce.registers.modbus.client import ModbusClientError, SerialPortError

POLL_PERIOD_S = 0.5
SERIAL_HINT = "does [modbus_rtu] of the instrument have this baud rate, parity and unit?"
#: Addresses of the two columns: measured values, and requested values. Integer copies of measured values
#: are left out.
COLUMNS = (range(37), (*range(512, 544), 546))


def watch_modbus(url: str, seconds: float | None, json_lines: bool) -> None:
    """Read and show the registers twice per second.

    Raises ServerError if no server answers at `url`, ConfigurationError for a file that `url` names.
    """
    open_client, stop = modbus_opener(url), stop_after(seconds)
    try:
        with open_client() as plc, _display(json_lines) as show:
            while True:
                show(plc.read())
                if stop.wait(POLL_PERIOD_S):
                    return
    except SerialPortError as error:
        raise ServerError(str(error)) from None
    except ModbusClientError as error:
        raise ServerError(f"{error}; {SERIAL_HINT if url.startswith('rtu') else CONNECTION_HINT}") from None


@contextmanager
def _display(json_lines: bool) -> Iterator[Callable[[dict[str, Any]], None]]:
    """Yield a function that shows the values: as JSON, as a live table on a terminal, or as a text line."""
    if json_lines:
        yield lambda values: print_line(json_line(values))
    elif sys.stdout.isatty():
        with Live(auto_refresh=False) as live:
            yield lambda values: live.update(_register_table(values), refresh=True)
    else:
        format_changes = _change_formatter()
        yield lambda values: print_line(format_changes(values))


def _change_formatter() -> Callable[[dict[str, Any]], str]:
    """Return a function that formats the values that differ from those of its previous call."""
    shown: dict[str, str] = {}

    def format_changes(values: dict[str, Any]) -> str:
        texts = {
            name: _format_register(BY_NAME[name], value)
            for name, value in values.items()
            if any(BY_NAME[name].address in addresses for addresses in COLUMNS)
        }
        changed = [f"{name} {text}" for name, text in texts.items() if text != shown.get(name)]
        shown.update(texts)
        return f"{time.strftime('%H:%M:%S')}  " + "  ".join(changed)

    return format_changes


def _register_table(values: dict[str, Any]) -> Table:
    """Return a table with the measured values on the left and the requests on the right."""
    table = Table.grid(padding=(0, 2))
    table.add_row(*(_column(values, addresses) for addresses in COLUMNS))
    return table


def _column(values: dict[str, Any], addresses: Container[int]) -> Table:
    table = Table.grid(padding=(0, 2))
    for name, value in values.items():
        register = BY_NAME[name]
        if register.address in addresses:
            table.add_row(str(register.address), name, _format_register(register, value))
    return table


def _format_register(register: Register, value: Any) -> str:
    """Return a value as text, in the unit of its register."""
    if not register.unit or not math.isfinite(value):
        return format_value(register, value)
    code = register.encode(value)
    return f"{code} {register.unit}" if isinstance(code, int) else f"{code:.3f} {register.unit}"
