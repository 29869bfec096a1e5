"""TPDOs: when each is sent, by its transmission type, inhibit time and event timer (CiA 301, 7.2.2)."""

from __future__ import annotations

import math

from registers.can.frames import Frame
from registers.canopen.communication import BY_EVENT, OFF, tpdo_at
from registers.canopen.parameters import Parameters

_ROUNDING_S = 1e-6


class Tpdo:
    """One TPDO; its data are rendered by whoever sends it."""

    def __init__(self, number: int, frame: Frame, parameters: Parameters) -> None:
        """The TPDO `number` (the first is 0) carries `frame`."""
        self.frame = frame
        self._index = tpdo_at(number)
        self._parameters = parameters
        self.begin()

    def begin(self) -> None:
        """Start anew, as on entering Operational: what has an event timer is due at once."""
        self._event = False
        self._syncs = 0
        self._sent_s = -math.inf

    def event(self) -> None:
        """Note that there is something to tell."""
        self._event = True

    def due(self, now_s: float) -> bool:
        """Whether to send it now, by event or by time; what is sent at SYNC is not."""
        if self._off or self._type not in BY_EVENT:
            return False
        inhibit_s, timer_s = self._parameters[self._index, 3] / 1e4, self._parameters[self._index, 5] / 1e3
        passed_s = now_s - self._sent_s + _ROUNDING_S
        if passed_s < inhibit_s or not (self._event or 0 < timer_s <= passed_s):
            return False
        self._event, self._sent_s = False, now_s
        return True

    def due_at_sync(self) -> bool:
        """Whether to send it at the SYNC that has just come."""
        if self._off or self._type in BY_EVENT:
            return False
        self._syncs += 1
        if not (self._event if self._type == 0 else self._syncs >= self._type):
            return False
        self._event, self._syncs = False, 0
        return True

    @property
    def _off(self) -> bool:
        return bool(self._parameters[self._index, 1] & OFF)

    @property
    def _type(self) -> int:
        return self._parameters[self._index, 2]
