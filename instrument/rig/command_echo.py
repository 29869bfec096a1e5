"""Latest possible time of a sample, derived from the command sequence number that the sample echoes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

#: Longest time from sending a command to a sample that echoes the command: one loop of the board,
#: and the transfer by USB.
COMMAND_LATENCY_S = 0.02
_MAX_UNCONFIRMED = 128  #: must be below 256, because an echo is the low byte of a sequence number


@dataclass(slots=True)
class CommandEcho:
    """Commands that were sent and that no sample has echoed yet.

    A sample that does not echo a command was taken before the board received the command. If the serial
    connection delays all bytes, old samples therefore do not look new.
    """

    _unconfirmed: list[tuple[int, float]] = field(default_factory=list)  # sequence numbers and times

    def command_sent(self, sequence: int, now_s: float) -> None:
        """Record that a command was sent at `now_s`."""
        self._unconfirmed.append((sequence & 0xFF, now_s))
        del self._unconfirmed[:-_MAX_UNCONFIRMED]

    def latest_s(self, echo: int) -> float:
        """Return the latest time [s] at which a sample with this echo can have been taken.

        The result is infinite if every sent command was echoed.
        """
        for index, (sequence, _) in enumerate(self._unconfirmed):
            if sequence == echo:
                del self._unconfirmed[: index + 1]
                break
        return self._unconfirmed[0][1] + COMMAND_LATENCY_S if self._unconfirmed else math.inf
