"""Report of a failed command: one sentence, or with --json one JSON object with the same keys everywhere."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pneuforce.client.details import fault_named
from pneuforce.errors import PneuforceError, Rejected, Tripped
from pneuforce.instrument.cli.terminal.command_words import fault_values, in_command_words
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode, exit_code_of
from pneuforce.instrument.cli.terminal.output import done_values

#: Whether the balloon may be inflated, for the exit codes that say so.
_MAY_BE_INFLATED: Mapping[ExitCode, bool] = {ExitCode.VENT_NOT_CONFIRMED: True, ExitCode.HOLD_ENDED: False}


def failure_text(error: BaseException) -> str:
    """Return the sentence about an error, with the notes that were added to the error."""
    notes = getattr(error, "__notes__", [])
    return in_command_words(" ".join([f"{str(error).rstrip('.')}.", *notes]) if notes else str(error))


def failure_values(error: BaseException, message: str | None = None) -> dict[str, Any]:
    """Return the values of an error for JSON. `message` replaces the sentence about the error."""
    code = exit_code_of(error)
    fault, remedy = fault_named(getattr(error, "fault", "")), getattr(error, "remedy", None)
    values = {
        "ok": False,
        "code": code.name.lower(),
        "exit_code": int(code),
        "message": message or failure_text(error),
        "reason": _reason(error),
        "remedy": None if remedy is None else in_command_words(remedy),
        "fault": None if fault is None else fault_values(fault),
    }
    inflated = _MAY_BE_INFLATED.get(code)
    return values | ({} if inflated is None else {"balloon_may_be_inflated": inflated})


def checked_values(passed: bool, message: str) -> dict[str, Any]:
    """Return the values of a check that is done, for JSON. A check that has failed has the same keys.

    `message` is the result of the check in words.
    """
    return done_values(message) if passed else failure_values(PneuforceError(message))


def _reason(error: BaseException) -> str | None:
    """Return the reject reason of a request, "tripped" if a fault is the cause, None for all other errors."""
    if isinstance(error, Rejected):
        return error.reason
    has_fault: object = getattr(error, "fault", "")
    return "tripped" if isinstance(error, Tripped) or has_fault else None
