"""Arming: what has to happen, and in which order, before the rig may inflate.

Nothing inflates by surprise. After a start the balloon stays vented until mode "vent" has been seen and then
"hold" is asked; after a trip the faults must be cleared before that. A program that never stops writing
"hold" gets no further.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

from instrument.refusal import Refusal


class Arming(Enum):
    """How far the way to an inflated balloon has been gone."""

    TRIPPED = auto()  #: a fault is latched
    CLEARED = auto()  #: no fault, but "vent" has not been seen since
    READY = auto()  #: "hold" may be asked
    HOLDING = auto()  #: "hold" has been asked


class Step(Enum):
    """What may happen."""

    TRIP = auto()
    CLEAR = auto()
    VENT = auto()
    HOLD = auto()


#: Where a step leads; a step that is not listed is refused.
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

#: Why "hold" is refused where `STEPS` has no way.
HOLD_REFUSALS: Mapping[Arming, Refusal] = {
    Arming.TRIPPED: Refusal.FAULT_LATCHED,
    Arming.CLEARED: Refusal.STATE,
}
