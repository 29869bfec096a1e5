"""Monitor that checks in the samples whether the board follows the command to hold or to vent."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pneuforce.instrument.rig.link import MAX_SAMPLE_SPAN_S
from pneuforce.protocol.frames import BoardState
from pneuforce.protocol.limits import PRESSURISED

FOLLOW_S = 1.0  #: time limit after a command: the board must then fill or empty the balloon
ROUND_TRIP_S = 0.05  #: time in which a command is sent, received and visible in the samples


@dataclass(slots=True)
class CommandMonitor:
    """Comparison of the board's state with the command, after each vent and each hold."""

    vent_due: bool = False  #: a requested vent is not yet visible in the samples, so only vents are sent
    _hold: bool = False  # the last command was a hold
    _command_s: float = -math.inf
    _vent_requested_s: float = -math.inf
    _deviating_s: float = 0.0
    _followed_s: float = -math.inf
    _filled: bool = False  # the balloon was filled since the last request to hold

    def request_vent(self, now_s: float) -> None:
        """Ensure that the board receives a vent, even if a hold is requested next."""
        self.vent_due, self._vent_requested_s = True, now_s

    def request_hold(self) -> None:
        """Reset the monitor for a new hold: the board may empty the balloon before it fills the balloon."""
        self._filled = False

    def set_command(self, hold: bool, now_s: float) -> None:
        """Store the command that the board receives from now on.

        Samples that were taken before a change of the command are not compared with the new command.
        """
        if hold != self._hold:
            self._hold, self._command_s = hold, now_s

    def follow(self, state: int, hold: bool, now_s: float) -> bool:
        """Process the state of the board; return False if the board has not followed the command in time.

        A hold may begin with emptying the balloon, which has no time limit. After the balloon was filled,
        emptying is a deviation.
        """
        filled = state in PRESSURISED
        self.vent_due = self.vent_due and (filled or not now_s >= self._vent_requested_s + ROUND_TRIP_S)
        hold = hold and not self.vent_due
        emptying_first = hold and state == BoardState.VENTING and not self._filled
        follows = filled == hold or emptying_first
        passed_s = min(now_s - self._followed_s, MAX_SAMPLE_SPAN_S) if now_s >= self._command_s else 0.0
        self._deviating_s = 0.0 if follows else self._deviating_s + passed_s
        self._followed_s = now_s
        self._filled = self._filled or (filled and hold)
        return self._deviating_s <= FOLLOW_S
