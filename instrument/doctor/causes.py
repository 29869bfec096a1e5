"""Remedy for each fault that the board or the host process has latched."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from pneuforce.instrument.core.faults import HostFault
from pneuforce.protocol.frames import Fault

SENSOR = "check the sensor: A0, the 100 kΩ from A0 to ground, the 5 V supply"
SUPPLY = (
    "use another USB port or cable; the coils of the relays need a separate supply; on a new board, measure "
    "the reference voltage (docs/firmware.md)"
)
RESTART = "check the supply of the board, which restarted, RESET, and programs that open its port"
LINE = "check the cable, and stop other programs on this machine: see the rows samples and gaps"
INFLATED = "THE BALLOON MAY BE INFLATED: "

CAUSES: Mapping[int, str] = {
    Fault.SENSOR: SENSOR,
    Fault.SENSOR_FROZEN: SENSOR,
    Fault.SUPPLY_VOLTAGE: SUPPLY,
    Fault.OVERPRESSURE: "check the regulator and whether the inlet valve closes; do not touch the balloon",
    Fault.BURST: "check the balloon, its joint, and whether the vent valve stays closed",
    Fault.LIMIT_POINT: "use a lower setpoint: the balloon cannot hold this pressure",
    Fault.NO_RISE: "check the gas supply, the inlet valve and its relay, and that the vent valve closes",
    Fault.INLET_OPEN: "clean or replace the inlet valve, which does not close; check its relay",
    Fault.VENT_SHUT: INFLATED + "check the vent valve and its relay",
    Fault.OCCLUSION: INFLATED + "check the tube for a kink, and the regulator, which may be far too high",
    Fault.LEAK: "check the joints with soapy water",
    Fault.SETPOINT_TIMEOUT: "check for a hole, a valve that leaks, and an orifice that is too small",
    Fault.HOST_SILENT: LINE,
    Fault.WATCHDOG: "check the supply of the board, which restarted by itself, and flash it: pneuforce flash",
    HostFault.BOARD_RESET: RESTART,
    HostFault.LINK_LOST: LINE,
    HostFault.PRESSURE_LIMIT: "check whether the inlet valve closes; do not touch the balloon",
    HostFault.SENSOR_LIMIT: SENSOR,
    HostFault.BOARD_UNRESPONSIVE: "flash the firmware of the board: pneuforce flash",
    HostFault.DISAGREEMENT: RESTART,
    HostFault.NOT_VENTED: INFLATED + "check the vent valve and its relay",
}

#: Faults after which the balloon may still be inflated.
NOT_EMPTIED = frozenset({Fault.VENT_SHUT, Fault.OCCLUSION, HostFault.NOT_VENTED})


def causes_of(faults: Iterable[int]) -> str:
    """Return what to do about the given faults, each remedy once."""
    return "; ".join(dict.fromkeys(CAUSES[fault] for fault in faults if fault in CAUSES))
