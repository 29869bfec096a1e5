"""Faults: codes, status bits, and the latch that keeps faults until they are cleared."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

from pneuforce.protocol.frames import Fault


class HostFault(IntEnum):
    """Faults that the host detects. Faults that the board detects have codes below 16."""

    LEASE_EXPIRED = 32
    BOARD_RESET = 33
    LINK_LOST = 34
    PRESSURE_LIMIT = 35  #: the host measured a pressure outside its limits
    SENSOR_LIMIT = 36  #: the host measured a sensor or supply voltage outside its limits
    BOARD_UNRESPONSIVE = 37  #: the clock of the board has stopped or is wrong
    #: The board does not hold although it was commanded to, or its state changes too often.
    DISAGREEMENT = 38
    #: The board does not vent although it was commanded to, or its state changes too often.
    NOT_VENTED = 39
    FORCE_LIMIT = 40  #: the force limit was exceeded and vent_on_force_limit is set
    CAN_MASTER_LOST = 41  #: the monitored heartbeat of the CANopen master is missing


#: Status bit of each fault that has a bit of its own. The other faults appear in the registers state and
#: first_out_fault, and in the status bit "failure".
STATUS_OF: Mapping[int, str] = {
    Fault.SENSOR: "sensor_fault",
    Fault.SENSOR_FROZEN: "sensor_fault",
    Fault.SUPPLY_VOLTAGE: "sensor_fault",
    Fault.OVERPRESSURE: "overpressure",
    Fault.BURST: "burst",
    Fault.LIMIT_POINT: "burst",
    Fault.NO_RISE: "inlet_fault",
    Fault.INLET_OPEN: "inlet_fault",
    Fault.VENT_SHUT: "vent_fault",
    Fault.OCCLUSION: "vent_fault",
    Fault.LEAK: "leak",
    Fault.SETPOINT_TIMEOUT: "setpoint_not_reached",
    Fault.WATCHDOG: "board_watchdog",
    HostFault.LEASE_EXPIRED: "lease_expired",
    HostFault.BOARD_RESET: "board_reset",
    HostFault.PRESSURE_LIMIT: "overpressure",
    HostFault.SENSOR_LIMIT: "sensor_fault",
    HostFault.BOARD_UNRESPONSIVE: "sensor_fault",
    HostFault.DISAGREEMENT: "board_reset",
    HostFault.NOT_VENTED: "vent_fault",
}


_NAMES = {fault.value: fault.name for fault in (*Fault, *HostFault)}


@dataclass(slots=True)
class FaultLatch:
    """Latched faults in the order of their occurrence (ISA-18.2: the first is the first-out fault)."""

    _codes: list[int] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self._codes)

    def __contains__(self, code: int) -> bool:
        return code in self._codes

    def set(self, code: int) -> bool:
        """Latch a fault; return True if it was not latched before."""
        if code in self._codes:
            return False
        self._codes.append(code)
        return True

    def __iter__(self) -> Iterator[int]:
        return iter(self._codes)

    def clear(self, codes: Iterable[int]) -> None:
        """Remove the faults with these codes."""
        removed = set(codes)
        self._codes = [code for code in self._codes if code not in removed]

    @property
    def first(self) -> int:
        """Return the code of the first-out fault, 0 if no fault is latched."""
        return self._codes[0] if self._codes else 0

    @property
    def status(self) -> frozenset[str]:
        """Return the names of the status bits that the latched faults set."""
        return frozenset(STATUS_OF[code] for code in self._codes if code in STATUS_OF)


def name_of(code: int) -> str:
    """Return the name of a fault in plain words, or "fault N" for an unknown code of newer firmware."""
    known = _NAMES.get(code)
    return known.lower().replace("_", " ") if known else f"fault {code}"


def described(code: int) -> str:
    """Return the name and the code of a fault, as the journal and the event log show them."""
    return f"{name_of(code)} (fault {code})" if code in _NAMES else name_of(code)


def mask_of(bits: Iterable[int]) -> int:
    """Return a number in which the given bits are set."""
    return sum(1 << bit for bit in set(bits))


def codes_of(mask: int) -> Iterable[int]:
    """Return the fault codes in the fault mask of the board."""
    return (code for code in range(1, 16) if mask >> code & 1)
