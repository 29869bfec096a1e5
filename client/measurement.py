"""Measurement of the instrument as a program receives it, with its state and its status."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from pneuforce.errors import InvalidForce, UsageError
from pneuforce.registers.advice import NO_FORCE_REASONS, STATE_DESCRIPTIONS, STATUS_ADVICE


class State(StrEnum):
    """State of the rig. The force is measured only in the state `HOLDING`."""

    BOOT = "boot"
    VENTED = "vented"
    INFLATING = "inflating"
    SETTLING = "settling"
    HOLDING = "holding"
    VENTING = "venting"
    TRIPPED = "tripped"


#: States in which the instrument inflates or holds the balloon.
INFLATED = frozenset({State.INFLATING, State.SETTLING, State.HOLDING})
#: States in which no balloon is inflated, except after a trip.
NOT_INFLATED = (State.BOOT, State.VENTED, State.VENTING)


class Status(StrEnum):
    """Condition that the instrument reports. docs/faults.md explains each condition and its remedy."""

    IN_CONTACT = "in_contact"
    INFLATING = "inflating"
    HOLDING = "holding"
    VENTED = "vented"
    INTERPOLATED = "interpolated"
    OUT_OF_RANGE = "out_of_range"
    FORCE_HIGH_ALARM = "force_high_alarm"
    SETPOINT_NOT_REACHED = "setpoint_not_reached"
    STALE = "stale"
    LINK_LOST = "link_lost"
    SENSOR_FAULT = "sensor_fault"
    OVERPRESSURE = "overpressure"
    LEAK = "leak"
    BURST = "burst"
    LEASE_EXPIRED = "lease_expired"
    SIMULATED = "simulated"
    NOT_ZEROED = "not_zeroed"
    WRITE_PROTECT = "write_protect"
    BOARD_WATCHDOG = "board_watchdog"
    CAN_DOWN = "can_down"
    INLET_FAULT = "inlet_fault"
    VENT_FAULT = "vent_fault"
    BOARD_RESET = "board_reset"
    BASELINE_OLD = "baseline_old"
    MAINTENANCE_REQUIRED = "maintenance_required"
    OUT_OF_SPECIFICATION = "out_of_specification"
    FUNCTION_CHECK = "function_check"
    FAILURE = "failure"
    CALIBRATED = "calibrated"
    PROOF_TEST_OVERDUE = "proof_test_overdue"
    FORCE_HIGH_ALARM_2 = "force_high_alarm_2"
    ANY_FAILURE = "any_failure"


#: Conditions that can be the reason for a missing force. The first condition is the most important.
_REASONS = tuple(Status(name) for name in NO_FORCE_REASONS)


#: Explanation of a missing force without a condition: the end of an inflation, or an implausible state.
_NO_REASON = (
    "the force is not known yet: the instrument waits for a steady pressure, or checks the state of the "
    "board. If this lasts longer than 1 s, vent, and hold again"
)

#: Explanation of a missing force over a bus that does not transmit the status.
_REASON_NOT_TRANSMITTED = (
    "this bus does not transmit the reason: read the status over Modbus or CAN (pneuforce status), or on the "
    "web page"
)

#: Conditions in which the pressure does not prove that the balloon is empty.
_CONTRADICTING_VENTED = frozenset({Status.STALE, Status.LINK_LOST, Status.SENSOR_FAULT, Status.VENT_FAULT})


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """Values of one sample. A value that is not available, or that the bus does not transmit, is None.

    The force is different: `force_n` raises an exception if the force is not valid, so that a program cannot
    use an invalid force by mistake. `force_or_nan` returns NaN instead. In the same way, `status` raises an
    exception over a bus that does not transmit the status (RDT), so that an unknown alarm is not read as
    "no alarm". `status_or_none` returns None instead.
    """

    force_or_nan: float = math.nan  #: contact force [N], NaN if the force is not valid
    force_std_or_nan: float = math.nan  #: standard uncertainty of the force [N], NaN if not available
    pressure_kpa: float | None = None  #: filtered gauge pressure
    radius_mm: float | None = None  #: radius R_i of the inflated balloon before contact
    setpoint_kpa: float | None = None  #: setpoint in effect; None while the rig is vented or tripped
    state: State | None = None  #: state of the rig
    status_or_none: frozenset[Status] | None = None  #: the status, None if the bus does not transmit it
    #: Number of the sample. Modbus and RDT count samples, CAN counts Force frames. None without a new sample.
    sample_counter: int | None = None
    age_s: float | None = None  #: age of the sample when it was read (CAN: of the Force frame), if known

    @property
    def valid(self) -> bool:
        """Return True if the force is valid. Only a valid force may be used."""
        return math.isfinite(self.force_or_nan)

    @property
    def force_n(self) -> float:
        """Return the contact force [N]. Raises InvalidForce if the force is not valid."""
        if not self.valid:
            raise InvalidForce(self.reasons, self.explanation)
        return self.force_or_nan

    @property
    def force_std_n(self) -> float | None:
        """Return the standard uncertainty of the force [N], None if the bus does not transmit it.

        Without contact, this value is the detection limit. Raises InvalidForce if the force is not valid.
        """
        if not self.valid:
            raise InvalidForce(self.reasons, self.explanation)
        return number_or_none(self.force_std_or_nan)

    @property
    def status(self) -> frozenset[Status]:
        """Return all conditions that the instrument reports. Raises UsageError over RDT."""
        if self.status_or_none is None:
            raise UsageError(
                "the status is unknown, because this bus does not transmit it: read the status over Modbus "
                "or CAN, and compare the force with a limit in your program"
            )
        return self.status_or_none

    @property
    def balloon_empty(self) -> bool:
        """Return True if the instrument has verified that the balloon is empty, and no fault contradicts.

        After a blocked tube, it can be True although the balloon is inflated, until a proof test has passed:
        MAINTENANCE_REQUIRED is set, and `Details.maintenance_causes` contains "tube_unproven".
        `ForceSensor.wait_until_vented` checks this over Modbus.
        """
        status = self.status_or_none or frozenset()
        return Status.VENTED in status and not status & _CONTRADICTING_VENTED

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return the names of the conditions that explain a missing force; empty if the force is valid.

        Over RDT, the only known condition is "stale": no new sample has arrived.
        """
        if self.valid:
            return ()
        if self.status_or_none is None:
            return (Status.STALE.value,) if self.sample_counter is None else ()
        return tuple(bit.value for bit in _REASONS if bit in self.status_or_none)

    @property
    def explanation(self) -> str:
        """Return a text for people that explains a missing force; "" if the force is valid."""
        if self.valid:
            return ""
        texts = [f"{name}: {STATUS_ADVICE[name].what}" for name in self.reasons]
        if self.state not in (None, State.HOLDING):
            texts.insert(0, f"state {self.state}: {STATE_DESCRIPTIONS[str(self.state)]}")
        return " ".join(texts) or (_REASON_NOT_TRANSMITTED if self.status_or_none is None else _NO_REASON)

    @property
    def remedy(self) -> str:
        """Return what to do about a missing force, for the most important reason; "" without a reason.

        After a trip, the fault is the most important reason: a vent alone does not end the trip.
        """
        if not self.reasons:
            return ""
        tripped = self.state is State.TRIPPED and Status.FAILURE in self.reasons
        return STATUS_ADVICE[Status.FAILURE if tripped else self.reasons[0]].do


def number_or_none(value: float) -> float | None:
    """Return a decoded value, None for NaN (not available)."""
    return value if math.isfinite(value) else None


def state_of(name: str) -> State | None:
    """Return the state with this name, None for a state that this version does not know."""
    return State(name) if name in _STATE_NAMES else None


def status_of(names: Iterable[str]) -> frozenset[Status]:
    """Return the conditions with these names. Names that this version does not know are ignored."""
    return frozenset(Status(name) for name in names if name in _STATUS_NAMES)


_STATE_NAMES, _STATUS_NAMES = frozenset(State), frozenset(Status)
