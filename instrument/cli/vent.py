"""`pneuforce vent`: send a vent, then wait until the instrument has verified that the balloon is empty."""

from __future__ import annotations

import sys
from typing import Any

from pneuforce.client.address import connect, send_vent
from pneuforce.errors import ClientError, ConnectionFailed, VentNotConfirmed
from pneuforce.instrument.cli.exit_codes import ExitCode
from pneuforce.instrument.cli.operate import vented_text
from pneuforce.instrument.cli.output import json_line, print_result

STOP_SWITCH = "press the stop switch at the rig, which turns off the power of both valves"


def vent_and_confirm(url: str, timeout_s: float, as_json: bool) -> int:
    """Vent, wait for the confirmation, and print the result. Return the exit code."""
    code, message, pressure_kpa = _vent(url, timeout_s)
    if as_json:
        return print_result(json_line(_result(code, message, pressure_kpa)), code)
    return print_result(message, code, sys.stderr if code else None)


def _result(code: ExitCode, message: str, pressure_kpa: float | None) -> dict[str, Any]:
    sent, confirmed = code is not ExitCode.UNAVAILABLE, code is ExitCode.DONE
    return {"sent": sent, "confirmed": confirmed, "pressure_kpa": pressure_kpa, "message": message}


def _vent(url: str, timeout_s: float) -> tuple[ExitCode, str, float | None]:
    """Return the exit code, the message, and the pressure after the vent [kPa]."""
    try:
        send_vent(url)
    except ConnectionFailed as error:
        message = f"pneuforce: the vent was NOT sent: {error}; {STOP_SWITCH}"
        return ExitCode.UNAVAILABLE, message, None
    try:
        with connect(url) as sensor:
            pressure_kpa = sensor.wait_until_vented(timeout_s).pressure_kpa
    except VentNotConfirmed as error:
        return ExitCode.VENT_NOT_CONFIRMED, f"pneuforce: {error}", error.pressure_kpa
    except ClientError as error:
        message = f"pneuforce: the vent was sent, but not confirmed: {error}; {STOP_SWITCH}"
        return ExitCode.VENT_NOT_CONFIRMED, message, None
    return ExitCode.DONE, vented_text(pressure_kpa), pressure_kpa
