"""`pneuforce watch modbus`: show the registers as a PLC reads them."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table

from pneuforce.client.address import modbus_opener
from pneuforce.errors import ServerError
from pneuforce.instrument.cli.terminal.output import (
    CONNECTION_HINT,
    format_value,
    json_line,
    print_line,
    stop_after,
)
from pneuforce.registers.map import BY_NAME, Register
from pneuforce.registers.modbus.client import ModbusClientError, SerialPortError

POLL_PERIOD_S = 0.5
NOT_AVAILABLE = "–"
SERIAL_HINT = "does [modbus_rtu] of the instrument have this baud rate, parity and unit?"
#: Addresses of the two columns of the table: measured values, and requested values. Integer copies of
#: measured values are left out. The status is below the columns, because its text is long.
STATUS = BY_NAME["status"]
FIRST_FAULT = BY_NAME["first_out_fault"]
COLUMNS = (frozenset(range(37)) - {STATUS.address}, (*range(512, 544), 546))
MAX_WIDTH = 1000  #: above the width of any table [characters]
VALUE_WIDTH = 10  #: least width of the values in the table [characters], so that the table does not move
#: Registers of a text line, and the width of their texts [characters]. All lines have the same columns.
LINE = {
    "force": 9,
    "force_uncertainty": 9,
    "pressure": 10,
    "setpoint": 10,
    "contact_counter": 5,
    "sample_age": 7,
    "state": 9,
    "first_out_fault": 4,
    "reject_reason": 4,
    "status": 0,
}


def watch_modbus(url: str, seconds: float | None, json_lines: bool) -> None:
    """Read and show the registers twice per second.

    Raises ServerError if no server answers at `url`, ConfigurationError for a file that `url` names.
    """
    open_client, stop = modbus_opener(url), stop_after(seconds)
    try:
        with open_client() as plc, _display(json_lines) as show:
            while True:
                show(plc.read() | plc.read_block(range(FIRST_FAULT.address, FIRST_FAULT.address + 1)))
                if stop.wait(POLL_PERIOD_S):
                    return
    except SerialPortError as error:
        raise ServerError(str(error)) from None
    except ModbusClientError as error:
        raise ServerError(f"{error}; {SERIAL_HINT if url.startswith('rtu') else CONNECTION_HINT}") from None


@contextmanager
def _display(json_lines: bool) -> Iterator[Callable[[dict[str, Any]], None]]:
    """Yield a function that shows the values: as JSON, as a live table on a terminal, or as a text line.

    The table is updated in place, and contains more registers than a line.
    """
    if json_lines:
        yield lambda values: print_line(json_line(named(values)))
    elif sys.stdout.isatty():
        with Live(auto_refresh=False) as live:
            yield lambda values: live.update(register_table(values, live.console), refresh=True)
    else:
        yield lambda values: print_line(f"{time.strftime('%H:%M:%S')}  {text_line(values)}")


def named(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values with a name instead of each code that has one, as in the text line."""
    return {
        name: value if (legend := BY_NAME[name].legend) is None else legend.names.get(value, str(value))
        for name, value in values.items()
    }


def text_line(values: dict[str, Any]) -> str:
    """Return the most important registers as a line. Every line has the same columns."""
    texts = (
        f"{name} {_format_register(BY_NAME[name], values[name]):>{width}}" for name, width in LINE.items()
    )
    return "  ".join(texts)


def register_table(values: dict[str, Any], console: Console) -> Group:
    """Return a table with measured values on the left and requests on the right, and the status below.

    The table fits into a terminal with 80 columns and 24 lines. A narrower terminal would cut digits off the
    values: it shows the most important registers instead, one below the other.
    """
    table = Table.grid(padding=(0, 2))
    table.add_row(*(_column(values, addresses) for addresses in COLUMNS))
    if console.measure(table, options=console.options.update_width(MAX_WIDTH)).maximum > console.width:
        return Group(*(f"{name}  {_format_register(BY_NAME[name], values[name])}" for name in LINE))
    below = (
        f"{register.address}  {register.name}  {_format_register(register, values[register.name])}"
        for register in (STATUS, FIRST_FAULT)
    )
    return Group(table, *below)


def _column(values: dict[str, Any], addresses: Container[int]) -> Table:
    table = Table.grid(padding=(0, 2))
    table.add_column()
    table.add_column(no_wrap=True)
    table.add_column(min_width=VALUE_WIDTH, no_wrap=True)
    for name, value in values.items():
        register = BY_NAME[name]
        if register.address in addresses:
            table.add_row(str(register.address), name, _format_register(register, value))
    return table


def _format_register(register: Register, value: Any) -> str:
    """Return a value as text, in the unit of its register; a dash if the value is not available."""
    if isinstance(value, float) and not math.isfinite(value):
        return NOT_AVAILABLE
    if register.legend is not None:
        return register.legend.names.get(value, str(value))
    if not register.unit:
        return format_value(register, value)
    code = register.encode(value)
    return f"{code} {register.unit}" if isinstance(code, int) else f"{code:.3f} {register.unit}"
