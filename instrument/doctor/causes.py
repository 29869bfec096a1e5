"""Parts to check for each fault that the board or the host process has latched."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from pneuforce.instrument.core.faults import HostFault
from pneuforce.protocol.frames import Fault

SENSOR = "the sensor: A0, the 100 kΩ from A0 to ground, the 5 V supply"
SUPPLY = "another USB port or cable; the coils of the relays need a separate supply"
RESTART = "the board restarted: check its supply, RESET, and programs that open its port"
LINE = "an overloaded machine, or the cable: see samples and gaps"
INFLATED = "THE BALLOON MAY BE INFLATED: "

CAUSES: Mapping[int, str] = {
    Fault.SENSOR: SENSOR,
    Fault.SENSOR_FROZEN: SENSOR,
    Fault.SUPPLY_VOLTAGE: SUPPLY,
    Fault.OVERPRESSURE: "the regulator, an inlet valve that does not close, or a contact with the balloon",
    Fault.BURST: "the balloon, its joint, or a vent valve that opens",
    Fault.LIMIT_POINT: "the balloon cannot hold this pressure: use a lower setpoint",
    Fault.NO_RISE: "the gas supply, the inlet valve and its relay",
    Fault.INLET_OPEN: "the inlet valve, which does not close",
    Fault.VENT_SHUT: INFLATED + "the vent valve and its relay",
    Fault.OCCLUSION: INFLATED + "a kinked tube, or a regulator that is far too high",
    Fault.LEAK: "the joints: use soapy water",
    Fault.SETPOINT_TIMEOUT: "a hole, a valve that leaks, or an orifice that is too small",
    Fault.HOST_SILENT: LINE,
    Fault.WATCHDOG: "the board restarted by itself: its supply, or a firmware that hangs",
    HostFault.BOARD_RESET: RESTART,
    HostFault.LINK_LOST: LINE,
    HostFault.PRESSURE_LIMIT: "an inlet valve that does not close, or a contact with the balloon",
    HostFault.SENSOR_LIMIT: SENSOR,
    HostFault.BOARD_UNRESPONSIVE: "the firmware of the board: pneuforce flash",
    HostFault.DISAGREEMENT: RESTART,
    HostFault.NOT_VENTED: INFLATED + "the vent valve and its relay",
}

#: Faults after which the balloon may still be inflated.
NOT_EMPTIED = frozenset({Fault.VENT_SHUT, Fault.OCCLUSION, HostFault.NOT_VENTED})


def causes_of(faults: Iterable[int]) -> str:
    """Return the parts to check for the given faults, each part once."""
    return "; ".join(dict.fromkeys(CAUSES[fault] for fault in faults if fault in CAUSES))
