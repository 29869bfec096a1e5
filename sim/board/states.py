"""The pressure state machine as a table. What a state's row does not name changes nothing."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

from instrument.rig.frames import BoardState, Valve


class Happening(Enum):
    """What moves the board from one state to another."""

    VENT_ASKED = auto()
    HOLD_ASKED = auto()  #: by a host that has asked for VENT since boot, trip or greeting
    EMPTY = auto()  #: vented, and verified so
    NEAR = auto()  #: the inlet was closed early, the rest of the way is lag
    FAR = auto()  #: too far below the setpoint for short pulses
    SETTLED = auto()
    RETARGETED = auto()  #: another setpoint, or a top-up
    GREETED = auto()  #: another host may have come
    TRIPPED = auto()
    CLEARED = auto()  #: no latched fault is left


class ResetCause(Enum):
    """Why the board has booted."""

    POWER_ON = auto()
    EXTERNAL = auto()  #: the button, or a host that opens the port
    BROWN_OUT = auto()
    WATCHDOG = auto()


B, H = BoardState, Happening

TRANSITIONS: Mapping[BoardState, Mapping[Happening, BoardState]] = {
    B.BOOT: {H.EMPTY: B.VENTED, H.TRIPPED: B.TRIPPED},
    B.VENTED: {H.HOLD_ASKED: B.INFLATING, H.TRIPPED: B.TRIPPED},
    B.INFLATING: {
        H.NEAR: B.SETTLING,
        H.VENT_ASKED: B.VENTING,
        H.GREETED: B.VENTING,
        H.TRIPPED: B.TRIPPED,
    },
    B.SETTLING: {
        H.FAR: B.INFLATING,
        H.SETTLED: B.HOLDING,
        H.VENT_ASKED: B.VENTING,
        H.GREETED: B.VENTING,
        H.TRIPPED: B.TRIPPED,
    },
    B.HOLDING: {H.RETARGETED: B.SETTLING, H.VENT_ASKED: B.VENTING, H.TRIPPED: B.TRIPPED},
    B.VENTING: {H.EMPTY: B.VENTED, H.TRIPPED: B.TRIPPED},
    B.TRIPPED: {H.CLEARED: B.VENTING},
}

#: `Valve` masks as plain integers: those of the enum take a microsecond for each `&`.
SAFE = int(Valve.NONE)
LOCKED = int(Valve.VENT_CLOSED)
FILL = int(Valve.VENT_CLOSED | Valve.INLET_OPEN)

#: States with a setpoint in effect. In every other one the valves are SAFE.
FILLING = frozenset({B.INFLATING, B.SETTLING})
EVERY = frozenset(BoardState)
EMPTYING = frozenset({B.BOOT, B.VENTING, B.TRIPPED})
#: Resets that nobody asked for: `Fault.WATCHDOG` is latched.
UNASKED = frozenset({ResetCause.BROWN_OUT, ResetCause.WATCHDOG})
