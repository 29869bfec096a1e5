"""Arming: the steps that must happen, in order, before the rig may inflate.

The balloon is never inflated unexpectedly. After a start it stays vented until a peer writes mode "vent" and
then mode "hold". After a trip the faults must be cleared first. A program that writes "hold" in each cycle
therefore does not inflate the balloon.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

from pneuforce.instrument.core.reject_reason import RejectReason


class Arming(Enum):
    """State of arming."""

    TRIPPED = auto()  #: a fault is latched
    CLEARED = auto()  #: no fault, but no "vent" since the start or the clearing of faults
    READY = auto()  #: "hold" is allowed
    HOLDING = auto()  #: "hold" is in effect


class Step(Enum):
    """Event that changes the state of arming."""

    TRIP = auto()
    CLEAR = auto()
    VENT = auto()
    HOLD = auto()


#: Next state for each state and step. A step that is not listed is rejected.
STEPS: Mapping[Arming, Mapping[Step, Arming]] = {
    Arming.TRIPPED: {Step.TRIP: Arming.TRIPPED, Step.CLEAR: Arming.CLEARED, Step.VENT: Arming.TRIPPED},
    Arming.CLEARED: {Step.TRIP: Arming.TRIPPED, Step.CLEAR: Arming.CLEARED, Step.VENT: Arming.READY},
    Arming.READY: {
        Step.TRIP: Arming.TRIPPED,
        Step.CLEAR: Arming.READY,
        Step.VENT: Arming.READY,
        Step.HOLD: Arming.HOLDING,
    },
    Arming.HOLDING: {
        Step.TRIP: Arming.TRIPPED,
        Step.CLEAR: Arming.HOLDING,
        Step.VENT: Arming.READY,
        Step.HOLD: Arming.HOLDING,
    },
}

#: Reject reason of "hold" in each state in which "hold" is not allowed.
HOLD_REJECT_REASONS: Mapping[Arming, RejectReason] = {
    Arming.TRIPPED: RejectReason.FAULT_LATCHED,
    Arming.CLEARED: RejectReason.STATE,
}
