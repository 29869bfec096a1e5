"""Emergencies (CiA 301, 7.2.7): errors present, those to be told of, and the list of past ones."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from registers.can.frames import EMERGENCY, GENERIC_ERROR, MASTER_LOST, NO_ERROR, RIG_ERROR, encode
from registers.canopen.communication import ERRORS_KEPT

_COMMUNICATION = 0x11  #: error register: generic, communication
_MOST_WAITING = 32  #: while the node is stopped or an inhibit time runs; the newest are kept


class Emergencies:
    """One message for each error that has come, one for those that have gone; each tells of its instant."""

    def __init__(self) -> None:
        self.history: deque[int] = deque(maxlen=ERRORS_KEPT)  #: codes, the newest first
        self._waiting: deque[bytes] = deque(maxlen=_MOST_WAITING)
        self._faults: tuple[int, ...] = ()
        self._master_lost = False
        self._sent_s = -math.inf

    @property
    def register(self) -> int:
        """The error register (1001h)."""
        return (GENERIC_ERROR if self._faults else 0) | (_COMMUNICATION if self._master_lost else 0)

    def follow(self, snapshot: Any, *, master_lost: bool) -> None:
        """Take note of the faults of the rig and of the master, as they are now."""
        faults = snapshot.faults
        if (faults, master_lost) == (self._faults, self._master_lost):
            return
        before, was_lost = self._faults, self._master_lost
        self._faults, self._master_lost = faults, master_lost
        if was_lost > master_lost or not set(before) <= set(faults):
            self._note(NO_ERROR, snapshot)
        came = [MASTER_LOST] if master_lost > was_lost else []
        for code in came + [RIG_ERROR + fault for fault in faults if fault not in before]:
            self.history.appendleft(code)
            self._note(code, snapshot)

    def _note(self, code: int, snapshot: Any) -> None:
        self._waiting.append(encode(EMERGENCY, snapshot, error_code=code, error_register=self.register))

    def due(self, now_s: float, inhibit_s: float) -> list[bytes]:
        """Data of each message to send now: all, or one in each inhibit time."""
        if not self._waiting or now_s < self._sent_s + inhibit_s:
            return []
        self._sent_s = now_s
        if inhibit_s:
            return [self._waiting.popleft()]
        due = list(self._waiting)
        self._waiting.clear()
        return due
