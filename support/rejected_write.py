"""Writes in words for the log: the peer, the written values and the result, in the same way for each bus."""

from __future__ import annotations

from typing import NamedTuple


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


def describe_write(peer: tuple[str, str], written: str, result: str) -> str:
    """Return the line of the log for a write: channel and address of the peer, values, result."""
    return f"{' '.join(peer).strip()} wrote {written}: {result}"
