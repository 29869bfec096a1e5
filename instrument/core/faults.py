"""Faults: their codes, the status bit of each, and the latch that keeps them until they are cleared."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from enum import IntEnum

from instrument.rig.frames import Fault


class HostFault(IntEnum):
    """Faults that the host finds; their codes stand above the board's."""

    LEASE_EXPIRED = 32
    BOARD_RESET = 33
    LINK_LOST = 34
    PRESSURE_LIMIT = 35  #: the host's own look at the pressure limits
    SENSOR_LIMIT = 36  #: the host's own look at sensor and supply
    SENSOR_STUCK = 37  #: the board's clock stands still
    DISAGREEMENT = 38  #: the board does not hold though it was told to
    NOT_VENTED = 39  #: the board does not vent though it was told to
    FORCE_LIMIT = 40  #: the force limit was passed, and the configuration says to vent then
    CAN_MASTER_LOST = 41  #: the CANopen master's heartbeat, which was watched, stays away


#: Status bit of each fault; a fault without one shows in state, first fault and "failure".
STATUS_OF: Mapping[int, str] = {
    Fault.SENSOR: "sensor_fault",
    Fault.STUCK: "sensor_fault",
    Fault.SUPPLY_VOLTAGE: "sensor_fault",
    Fault.OVERPRESSURE: "overpressure",
    Fault.BURST: "burst",
    Fault.LIMIT_POINT: "burst",
    Fault.NO_RISE: "inlet_fault",
    Fault.INLET_OPEN: "inlet_fault",
    Fault.VENT_SHUT: "vent_fault",
    Fault.OCCLUSION: "vent_fault",
    Fault.LEAK: "leak",
    Fault.TIMEOUT: "setpoint_not_reached",
    Fault.WATCHDOG: "board_watchdog",
    HostFault.LEASE_EXPIRED: "lease_expired",
    HostFault.BOARD_RESET: "board_reset",
    HostFault.PRESSURE_LIMIT: "overpressure",
    HostFault.SENSOR_LIMIT: "sensor_fault",
    HostFault.SENSOR_STUCK: "sensor_fault",
    HostFault.DISAGREEMENT: "board_reset",
    HostFault.NOT_VENTED: "vent_fault",
}


_NAMES = {fault.value: fault.name for fault in (*Fault, *HostFault)}


class Latch:
    """Faults in the order of their coming; each stays until all are cleared."""

    def __init__(self) -> None:
        self._codes: dict[int, None] = {}

    def __len__(self) -> int:
        return len(self._codes)

    def __contains__(self, code: int) -> bool:
        return code in self._codes

    def set(self, code: int) -> bool:
        """Latch a fault; True where it is new."""
        if code in self._codes:
            return False
        self._codes[code] = None
        return True

    def __iter__(self) -> Iterator[int]:
        return iter(self._codes)

    def clear(self, codes: Iterable[int]) -> None:
        """Forget these."""
        for code in list(codes):
            self._codes.pop(code, None)

    @property
    def first(self) -> int:
        """Code of the first fault, 0 where there is none."""
        return next(iter(self._codes), 0)

    @property
    def status(self) -> frozenset[str]:
        """Names of the status bits."""
        return frozenset(STATUS_OF[code] for code in self._codes if code in STATUS_OF)


def name_of(code: int) -> str:
    """Name of a fault, for people; one that a later board may know and we do not is called by its number."""
    known = _NAMES.get(code)
    return known.lower().replace("_", " ") if known else f"fault {code}"


def codes_of(mask: int) -> Iterable[int]:
    """Fault codes of the board's fault mask."""
    return (code for code in range(1, 16) if mask >> code & 1)
