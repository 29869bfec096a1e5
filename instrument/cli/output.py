"""What a person or a program is shown: values with units, lines of JSON, how far a long run is, its end."""

from __future__ import annotations

import json
import math
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Timer
from typing import Any

from instrument.tape.entry import plain
from registers.field import Field, plain_unit

Told = Callable[[float, float | None], None]  #: what is done, and of how much where that is known
HINT = "is an instrument running there? (pneuforce demo starts one)"


def stop_after(seconds: float | None) -> Event:
    """An event that is set at Ctrl-C, at SIGTERM and, where a time is given, after it."""
    stop = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    if seconds is not None:
        timer = Timer(seconds, stop.set)
        timer.daemon = True
        timer.start()
    return stop


def with_unit(declared: Field, value: Any) -> str:
    """A value for a person, in the unit of its quantity, as the DBC gives it."""
    if isinstance(value, frozenset):
        return ", ".join(sorted(value)) or "none"
    if not isinstance(value, float):
        return str(value)
    return f"{value:.3f} {plain_unit(declared.unit)}" if math.isfinite(value) else "not available"


@contextmanager
def progress(title: str) -> Iterator[Told]:
    """A bar on stderr, where that is a terminal, and what moves it."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def as_json(seen: dict[str, Any]) -> str:
    """One line: null where a value is not available."""
    return json.dumps(plain(seen))
