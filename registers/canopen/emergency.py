"""Emergencies: errors present, those to be told of, and the list of past ones (1001h, 1003h)."""

from __future__ import annotations

import math
from collections import deque

from registers.can.frames import GENERIC_ERROR, MASTER_LOST, NO_ERROR, RIG_ERROR
from registers.canopen.communication import ERRORS_KEPT

_COMMUNICATION = 0x11  #: error register: generic, communication
_MOST_WAITING = 32


class Emergencies:
    """One message for each error that has come, one for those that have gone."""

    def __init__(self) -> None:
        self.history: deque[int] = deque(maxlen=ERRORS_KEPT)  #: codes, the newest first
        self._waiting: deque[tuple[int, int]] = deque(maxlen=_MOST_WAITING)
        self._faults: tuple[int, ...] = ()
        self._master_lost = False
        self._sent_s = -math.inf

    @property
    def register(self) -> int:
        """The error register."""
        return (GENERIC_ERROR if self._faults else 0) | (_COMMUNICATION if self._master_lost else 0)

    def follow(self, faults: tuple[int, ...], *, master_lost: bool) -> None:
        """Take note of the faults of the rig and of the master, as they are now."""
        if (faults, master_lost) == (self._faults, self._master_lost):
            return
        before, was_lost = self._faults, self._master_lost
        self._faults, self._master_lost = faults, master_lost
        if was_lost > master_lost or not set(before) <= set(faults):
            self._waiting.append((NO_ERROR, self.register))
        came = [MASTER_LOST] if master_lost > was_lost else []
        for code in came + [RIG_ERROR + fault for fault in faults if fault not in before]:
            self.history.appendleft(code)
            self._waiting.append((code, self.register))

    def due(self, now_s: float, inhibit_s: float) -> list[tuple[int, int]]:
        """Error code and register of each message to send now: all, or one in each inhibit time."""
        if not self._waiting or now_s < self._sent_s + inhibit_s:
            return []
        self._sent_s = now_s
        if inhibit_s:
            return [self._waiting.popleft()]
        due = list(self._waiting)
        self._waiting.clear()
        return due
