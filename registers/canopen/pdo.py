"""Transmission of TPDOs according to transmission type, inhibit time and event timer (CiA 301, 7.2.2)."""

from __future__ import annotations

import math

from pneuforce.registers.can.frames import FrameDefinition
from pneuforce.registers.canopen.communication import EVENT_DRIVEN, PDO_DISABLED, tpdo_index
from pneuforce.registers.canopen.parameters import Parameters

_ROUNDING_S = 1e-6


class Tpdo:
    """Transmission control of one TPDO. The caller encodes the data."""

    def __init__(self, number: int, frame: FrameDefinition, parameters: Parameters) -> None:
        """Create the TPDO `number`, starting at 0, which sends `frame`."""
        self.frame = frame
        self._index = tpdo_index(number)
        self._parameters = parameters
        self.start()

    def start(self) -> None:
        """Reset the TPDO when the node enters Operational. A TPDO with an event timer is then due at once."""
        self._triggered = False
        self._sync_count = 0
        self._sent_s = -math.inf

    def trigger(self) -> None:
        """Record an event of this TPDO."""
        self._triggered = True

    def due(self, now_s: float) -> bool:
        """Return True if the TPDO must be sent now, because of an event or the event timer.

        Returns False for a disabled or a synchronous TPDO.
        """
        if self._disabled or self._transmission_type not in EVENT_DRIVEN:
            return False
        inhibit_s, timer_s = self._parameters[self._index, 3] / 1e4, self._parameters[self._index, 5] / 1e3
        elapsed_s = now_s - self._sent_s + _ROUNDING_S
        if elapsed_s < inhibit_s or not (self._triggered or 0 < timer_s <= elapsed_s):
            return False
        self._triggered, self._sent_s = False, now_s
        return True

    def due_at_sync(self) -> bool:
        """Return True if the TPDO must be sent at the SYNC that was just received."""
        if self._disabled or self._transmission_type in EVENT_DRIVEN:
            return False
        self._sync_count += 1
        every_nth = self._transmission_type
        if not (self._triggered if every_nth == 0 else self._sync_count >= every_nth):
            return False
        self._triggered, self._sync_count = False, 0
        return True

    @property
    def _disabled(self) -> bool:
        return bool(self._parameters[self._index, 1] & PDO_DISABLED)

    @property
    def _transmission_type(self) -> int:
        return self._parameters[self._index, 2]
