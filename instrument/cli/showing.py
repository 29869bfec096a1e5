"""What a person or a program is shown of a bus: values with their units, lines of JSON, and the end of it."""

from __future__ import annotations

import json
import math
import signal
import sys
from threading import Event, Timer
from typing import Any

from registers.field import Field, plain_unit

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


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def as_json(seen: dict[str, Any]) -> str:
    """One line: null where a value is not available."""
    return json.dumps(_plain(seen))


def _plain(value: Any) -> Any:
    """A value that JSON knows: null where it is not available."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, frozenset):
        return sorted(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value
