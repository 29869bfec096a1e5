"""Rejected Commands in words, for the log."""

from __future__ import annotations

from pneuforce.registers.can.frames import COMMAND, COMMAND_MODES
from pneuforce.support.rejected_write import RejectedWrite


def rejected_command(data: bytes, reason: str, allowed: str = "") -> RejectedWrite:
    """Return a rejected Command in words. `allowed` overrides the remedy that belongs to the reason."""
    if len(data) != COMMAND.length:
        allowed = allowed or f"a Command has {COMMAND.length} bytes, not {len(data)}"
        return RejectedWrite(data, reason, f"Command {data.hex(' ')}".rstrip(), allowed)
    codes = COMMAND.codes(data)
    written = "Command with " + ", ".join(field.describe(codes[field.name]) for field in COMMAND.fields)
    return RejectedWrite(data, reason, written, allowed or _allowed_values(codes))


def _allowed_values(codes: dict[str, int]) -> str:
    for field in COMMAND.fields:
        if not field.accepts(codes[field.name]):
            return f"{field.name} {field.allowed_values}"
    is_hold = codes["mode"] == COMMAND_MODES.codes["hold"]
    return "mode hold needs a setpoint" if is_hold and not codes["setpoint"] else ""
