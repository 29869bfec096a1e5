"""Functions that the commands share: output of values, JSON and progress, and the end of a command."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from shutil import get_terminal_size
from textwrap import wrap
from threading import Event, Timer
from typing import Any, TextIO

from pneuforce.errors import WriteFailed
from pneuforce.instrument.cli.terminal.stop_signals import at_stop_signal
from pneuforce.instrument.stream.entry import json_safe
from pneuforce.registers.field import Field, quantity_unit
from pneuforce.support.printable import printable, printable_json

#: Callback for the progress of a long run: amount done, and total amount if known.
ReportProgress = Callable[[float, float | None], None]
MIN_HANGING_WIDTH = 30  #: smallest width of a column of text, in characters
CONNECTION_HINT = "is an instrument running there? (pneuforce demo starts one)"


def stop_after(seconds: float | None) -> Event:
    """Return an event that is set at the first stop signal, and after `seconds` if given."""
    stop = Event()
    at_stop_signal(stop.set)
    if seconds is not None:
        timer = Timer(seconds, stop.set)
        timer.daemon = True
        timer.start()
    return stop


def format_value(definition: Field, value: Any) -> str:
    """Return a value as text with its unit. The units are those of the DBC file."""
    if isinstance(value, frozenset):
        return ", ".join(sorted(value)) or "none"
    if not isinstance(value, float):
        return str(value)
    return f"{value:.3f} {quantity_unit(definition.unit)}" if math.isfinite(value) else "not available"


def pressure_text(pressure_kpa: float | None) -> str:
    """Return a pressure as text with its unit."""
    return "not available" if pressure_kpa is None else f"{round(pressure_kpa, 3) + 0.0:.3f} kPa"


@contextmanager
def progress(title: str) -> Iterator[ReportProgress]:
    """Show a progress bar on stderr if stderr is a terminal. Yields the callback that moves the bar."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def hanging(text: str, column: int) -> str:
    """Return a text that begins at a column, with its further lines at the same column.

    Only a terminal gets further lines: a program reads one line. A path without spaces is never divided.
    """
    width = get_terminal_size().columns - column
    if not sys.stdout.isatty() or width < MIN_HANGING_WIDTH:
        return text
    lines = wrap(text, width, break_long_words=False, break_on_hyphens=False)
    return f"\n{' ' * column}".join(lines)


def print_line(line: str) -> None:
    """Print a line and flush stdout."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def print_text(text: str, file: TextIO | None = None) -> None:
    """Print one or more lines. Escape control characters in the lines, for example from a file name."""
    print(printable(text, keep="\n"), file=file, flush=True)


def print_done(message: str, as_json: bool, **values: Any) -> None:
    """Print the result of a command that is done: a sentence, or JSON with the sentence and `values`.

    Raises WriteFailed with the result if it cannot be printed, so that stderr contains the result.
    """
    try:
        print_text(done_json(message, **values) if as_json else message)
    except OSError as error:
        raise WriteFailed(
            f"{message} The command is done, but its result cannot be written to stdout: {error.strerror}"
        ) from None


def done_json(message: str, **values: Any) -> str:
    """Return the result of a command that is done as one line of JSON: the common keys, then `values`."""
    return json_line(done_values(message) | values)


def done_values(message: str) -> dict[str, Any]:
    """Return the values of a command that is done, for JSON. A failure has the same keys."""
    done = {"ok": True, "code": "done", "exit_code": 0, "message": message}
    return done | dict.fromkeys(("reason", "remedy", "fault"))


def json_text(value: Any, indent: int | None = None) -> str:
    """Return a value as JSON without control characters, with null for a value that is not available."""
    return printable_json(json.dumps(json_safe(value), indent=indent, ensure_ascii=False))


def json_line(values: dict[str, Any]) -> str:
    """Return values as one line of JSON, with null for a value that is not available."""
    return json_text(values)
