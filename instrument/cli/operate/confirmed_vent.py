"""Confirmation of a vent, as text."""

from __future__ import annotations

from pneuforce.client.sensor import ForceSensor
from pneuforce.instrument.cli.terminal.output import pressure_text

STOP_SWITCH = "press the stop switch at the rig, which turns off the power of both valves"


def confirmed_vent(sensor: ForceSensor) -> str:
    """Wait for the confirmation of a vent, and return it as a sentence. Raises VentNotConfirmed."""
    return vented_text(sensor.wait_until_vented().pressure_kpa)


def vented_text(pressure_kpa: float | None) -> str:
    """Return the message about a confirmed vent. The sensor is on the board, and does not see the balloon."""
    return f"Vented: the sensor reads {pressure_text(pressure_kpa)}. Look at the balloon."
