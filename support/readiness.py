"""Wait until files or sockets can be read or written. `select.select` fails for descriptors above 1023."""

from __future__ import annotations

import math
import select
from collections.abc import Iterable


def readable(filenos: Iterable[int], timeout_s: float | None) -> list[int]:
    """Return the descriptors that can be read now, or that were closed by the other side.

    Waits until there is one, at most `timeout_s`; without a limit if it is None.
    """
    return _ready(filenos, select.POLLIN | select.POLLPRI, timeout_s)


def is_writable(fileno: int, timeout_s: float) -> bool:
    """Return True as soon as a descriptor can be written, False if it cannot be written for `timeout_s`."""
    return bool(_ready([fileno], select.POLLOUT, timeout_s))


def _ready(filenos: Iterable[int], events: int, timeout_s: float | None) -> list[int]:
    poll = select.poll()
    for fileno in filenos:
        poll.register(fileno, events)
    return [fileno for fileno, _ in poll.poll(None if timeout_s is None else math.ceil(1e3 * timeout_s))]
