"""Writes in words for the log: the peer, the written values and the result, in the same way for each bus."""

from __future__ import annotations

import logging
from collections import defaultdict
from typing import NamedTuple

from pneuforce.support.float32_text import float32_text
from pneuforce.support.throttle import RateLimitedLogger

_UNITS = {"kpa": "kPa", "n": "N", "s": "s"}  #: units of the written quantities, by the suffix of the name


class RejectedWrite(NamedTuple):
    """Write request that the server of a bus rejected and did not pass to the instrument."""

    request: bytes
    reason: str  #: short name of the reason, for example the exception of Modbus
    written: str  #: names of the registers or fields, with the values
    #: What is allowed, for example the limits of a register. Empty if the reason says everything.
    allowed: str = ""

    @property
    def result(self) -> str:
        """Return the result for a line of the log."""
        return f"rejected, {self.reason}" + (f": {self.allowed}" if self.allowed else "")


class RejectedWriteLogger:
    """Logger for rejected writes. Each channel has its own limit, so no peer hides writes on another bus."""

    def __init__(self, logger: logging.Logger) -> None:
        self._loggers: defaultdict[str, RateLimitedLogger] = defaultdict(lambda: RateLimitedLogger(logger))

    def log(self, peer: tuple[str, str], rejected: RejectedWrite, now_s: float) -> None:
        """Log one rejected write."""
        line = describe_write(peer, rejected.written, rejected.result)
        self._loggers[peer[0]].warning(now_s, "%s", line)


def describe_write(peer: tuple[str, str], written: str, result: str) -> str:
    """Return the line of the log for a write: channel and address of the peer, values, result."""
    return f"{' '.join(peer).strip()} wrote {written}: {result}"


def register_and_unit(quantity: str) -> tuple[str, str]:
    """Return the register name and the unit of a written quantity: "lease" and "s" for "lease_s"."""
    name, _, suffix = quantity.rpartition("_")
    return (name, _UNITS[suffix]) if suffix in _UNITS else (quantity, "")


def describe_quantity(quantity: str, value: object) -> str:
    """Return the register name of a written quantity and its value, for example "lease 1 s"."""
    name, unit = register_and_unit(quantity)
    shown = float32_text(value) if isinstance(value, float) else str(value)
    return f"{name} {shown} {unit}".rstrip()
