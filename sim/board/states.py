"""Transition table of the pressure state machine. Triggers that a state does not list change nothing."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

from pneuforce.protocol.frames import BoardState, Valve


class Trigger(Enum):
    """Trigger of a state transition."""

    VENT_REQUESTED = auto()
    HOLD_REQUESTED = auto()  #: the host requests HOLD after it has armed the board by VENT
    VENT_VERIFIED = auto()  #: the measured pressure shows that the balloon is empty
    NEAR_SETPOINT = auto()  #: the predicted pressure has reached the setpoint, and the inlet was closed
    FAR_BELOW_SETPOINT = auto()  #: the pressure is too far below the setpoint for short pulses
    SETTLED = auto()  #: the pressure has stayed in the band around the setpoint
    RETARGETED = auto()  #: the setpoint has changed, or a top-up is due
    IDENTIFIED = auto()  #: a host has sent Identify and may be a new host
    TEST_REQUESTED = auto()  #: the host requests a proof test
    TEST_FINISHED = auto()
    TRIPPED = auto()
    CLEARED = auto()  #: the last latched fault was cleared


class ResetCause(Enum):
    """Reason for a boot of the board."""

    POWER_ON = auto()
    EXTERNAL = auto()  #: the reset button, or a host that opens the port
    BROWN_OUT = auto()
    WATCHDOG = auto()


B, T = BoardState, Trigger

TRANSITIONS: Mapping[BoardState, Mapping[Trigger, BoardState]] = {
    B.BOOT: {T.VENT_VERIFIED: B.VENTED, T.TRIPPED: B.TRIPPED},
    B.VENTED: {T.HOLD_REQUESTED: B.INFLATING, T.TRIPPED: B.TRIPPED},
    B.INFLATING: {
        T.NEAR_SETPOINT: B.SETTLING,
        T.VENT_REQUESTED: B.VENTING,
        T.IDENTIFIED: B.VENTING,
        T.TRIPPED: B.TRIPPED,
    },
    B.SETTLING: {
        T.FAR_BELOW_SETPOINT: B.INFLATING,
        T.SETTLED: B.HOLDING,
        T.VENT_REQUESTED: B.VENTING,
        T.IDENTIFIED: B.VENTING,
        T.TRIPPED: B.TRIPPED,
    },
    B.HOLDING: {
        T.RETARGETED: B.SETTLING,
        T.TEST_REQUESTED: B.TESTING,
        T.VENT_REQUESTED: B.VENTING,
        T.TRIPPED: B.TRIPPED,
    },
    B.TESTING: {T.TEST_FINISHED: B.HOLDING, T.VENT_REQUESTED: B.VENTING, T.TRIPPED: B.TRIPPED},
    B.VENTING: {T.VENT_VERIFIED: B.VENTED, T.TRIPPED: B.TRIPPED},
    B.TRIPPED: {T.CLEARED: B.VENTING},
}

#: `Valve` masks as plain integers, because `&` of an IntFlag takes a microsecond.
SAFE = int(Valve.NONE)
LOCKED = int(Valve.VENT_CLOSED)
FILL = int(Valve.VENT_CLOSED | Valve.INLET_OPEN)

#: States in which the valves move the pressure towards a setpoint. HOLDING keeps the valves LOCKED, and
#: TESTING moves them in pulses; in all other states the valves are SAFE.
FILLING = frozenset({B.INFLATING, B.SETTLING})
ALL_STATES = frozenset(BoardState)
EMPTYING = frozenset({B.BOOT, B.VENTING, B.TRIPPED})
#: Resets that neither the operator nor the host caused. They latch `Fault.WATCHDOG`.
UNEXPECTED_RESETS = frozenset({ResetCause.BROWN_OUT, ResetCause.WATCHDOG})
