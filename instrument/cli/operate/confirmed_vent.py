"""Confirmation of a vent: its text, and the fault that prevents it."""

from __future__ import annotations

from pneuforce.client.details import LatchedFault
from pneuforce.client.measurement import Measurement
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import ClientError, VentFailed, VentNotConfirmed
from pneuforce.instrument.cli.terminal.output import pressure_text

STOP_SWITCH = "press the stop switch at the rig, which turns off the power of both valves"
TIMEOUT_S = 10.0
#: Faults that set the status bit `sensor_fault` or `link_lost`: the pressure proves no vent while one of them
#: is latched. A fault of the vent itself raises VentFailed.
PREVENTING_FAULTS = frozenset(
    {"sensor", "sensor_frozen", "supply_voltage", "sensor_limit", "board_unresponsive", "link_lost"}
)


class VentPrevented(VentNotConfirmed):
    """Vent that the instrument cannot verify while another fault is latched."""

    def __init__(self, fault: LatchedFault, pressure_kpa: float | None) -> None:
        ClientError.__init__(
            self,
            "the vent was sent to the instrument, but cannot be verified while the fault "
            f"{fault.name} is latched (pressure: {pressure_text(pressure_kpa)}). Look at the balloon: if it "
            f"is inflated, {STOP_SWITCH}. Fault {fault.name}: {fault.cause} {fault.remedy}",
        )
        self.fault, self.remedy, self.pressure_kpa = fault.name, fault.remedy, pressure_kpa


def wait_until_confirmed(sensor: ForceSensor, timeout_s: float = TIMEOUT_S) -> Measurement:
    """Wait after a vent until the vent is verified. Return the measurement that shows it.

    Raises VentNotConfirmed, which names the fault that prevents the verification.
    """
    try:
        return sensor.wait_until_vented(timeout_s)
    except VentFailed:
        raise
    except VentNotConfirmed as error:
        latched = sensor.details().latched_faults
        fault = next((each for each in latched if each.name in PREVENTING_FAULTS), None)
        if fault is None:
            raise
        raise VentPrevented(fault, error.pressure_kpa) from None


def confirmed_vent(sensor: ForceSensor) -> str:
    """Wait for the confirmation of a vent, and return it as a sentence. Raises VentNotConfirmed."""
    return vented_text(wait_until_confirmed(sensor).pressure_kpa)


def vented_text(pressure_kpa: float | None) -> str:
    """Return the message about a confirmed vent. The sensor is on the board, and does not see the balloon."""
    return f"Vented: the sensor reads {pressure_text(pressure_kpa)}. Look at the balloon."
