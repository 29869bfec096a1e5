"""What to look at for each fault that a board or the host has latched."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from instrument.faults import HostFault
from instrument.rig.frames import Fault

SENSOR = "the sensor: A0, its 100 kΩ to ground, its 5 V"
SUPPLY = "another USB port or cable; the relays' coils need a supply of their own"
RESTART = "the board restarted: its supply, RESET, a program that opens its port"
LINE = "a busy machine, or the cable: see samples and gaps"
INFLATED = "THE BALLOON MAY BE INFLATED: "

CAUSES: Mapping[int, str] = {
    Fault.SENSOR: SENSOR,
    Fault.STUCK: SENSOR,
    Fault.SUPPLY_VOLTAGE: SUPPLY,
    Fault.OVERPRESSURE: "the regulator, an inlet valve that does not shut; is the balloon pressed?",
    Fault.BURST: "the balloon, its joint, a vent valve that opens",
    Fault.LIMIT_POINT: "a balloon that takes no such pressure: a lower setpoint",
    Fault.NO_RISE: "the gas supply, the inlet valve and its relay",
    Fault.INLET_OPEN: "the inlet valve, which does not shut",
    Fault.VENT_SHUT: INFLATED + "the vent valve and its relay",
    Fault.OCCLUSION: INFLATED + "a kinked tube, or a regulator that is far too high",
    Fault.LEAK: "soap water on the joints",
    Fault.TIMEOUT: "a hole, a valve that leaks, an orifice that is too small",
    Fault.HOST_SILENT: LINE,
    Fault.WATCHDOG: "the board restarted by itself: its supply, or a program that hangs",
    HostFault.BOARD_RESET: RESTART,
    HostFault.LINK_LOST: LINE,
    HostFault.PRESSURE_LIMIT: "is the balloon pressed? the inlet valve",
    HostFault.SENSOR_LIMIT: SENSOR,
    HostFault.SENSOR_STUCK: "the board's program: pneuforce flash",
    HostFault.DISAGREEMENT: RESTART,
    HostFault.NOT_VENTED: INFLATED + "the vent valve and its relay",
}


def causes_of(faults: Iterable[int]) -> str:
    """What to look at, each thing once."""
    return "; ".join(dict.fromkeys(CAUSES[fault] for fault in faults if fault in CAUSES))
