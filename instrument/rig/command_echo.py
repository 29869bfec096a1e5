"""Latest possible time of a sample, derived from the command sequence number that the sample echoes."""

from __future__ import annotations

import math
from collections import deque

#: Longest time from sending a command to a sample that echoes the command: one loop of the board,
#: and the transfer by USB.
COMMAND_LATENCY_S = 0.02
_MAX_UNCONFIRMED = 128  #: must be below 256, because an echo is the low byte of a sequence number


class CommandEcho:
    """Commands that were sent and that no sample has echoed yet.

    A sample that does not echo a command was taken before the board received the command. If the serial
    connection delays all bytes, old samples therefore do not look new.
    """

    def __init__(self) -> None:
        self._unconfirmed: deque[tuple[int, float]] = deque(maxlen=_MAX_UNCONFIRMED)

    def command_sent(self, sequence: int, now_s: float) -> None:
        """Record that a command was sent at `now_s`."""
        self._unconfirmed.append((sequence & 0xFF, now_s))

    def latest_s(self, echo: int) -> float:
        """Return the latest time [s] at which a sample with this echo can have been taken.

        The result is infinite if every sent command was echoed.
        """
        if any(sequence == echo for sequence, _ in self._unconfirmed):
            while self._unconfirmed.popleft()[0] != echo:
                pass
        return self._unconfirmed[0][1] + COMMAND_LATENCY_S if self._unconfirmed else math.inf
