"""Monitor that checks in the samples whether the board follows the command to hold or to vent."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pneuforce.instrument.rig.link import MAX_SAMPLE_SPAN_S
from pneuforce.protocol.frames import BoardState
from pneuforce.protocol.limits import PRESSURISED

FOLLOW_S = 1.0  #: time limit after a command: the board must then fill or empty the balloon
ROUND_TRIP_S = 0.05  #: time in which a command is sent, received and visible in the samples
#: Duration of agreement after which a deviation counts less and less. A board needs at least 0.6 s from
#: VENTED to HOLDING.
STEADY_S = 0.5
#: Shortest time in which a board that leaves HOLDING can be in HOLDING again. The firmware needs 0.3 s.
MIN_REFILL_S = 0.2
#: Highest mean rate of state changes after one command, and largest number of changes above this rate. A
#: board changes its state at most twice in 0.3 s, while it corrects the pressure.
CHANGES_PER_S, MAX_CHANGES = 7.0, 10.0


@dataclass(slots=True)
class CommandMonitor:
    """Comparison of the board's state with the command, after each vent and each hold.

    The time of a deviation grows until the board has agreed with the command for `STEADY_S`, and then falls.
    A state that alternates between agreement and deviation therefore does not extend the time limit.
    """

    vent_due: bool = False  #: a requested vent is not yet visible in the samples, so only vents are sent
    _hold: bool = False  # the last command was a hold
    _command_s: float = -math.inf
    _vent_requested_s: float = -math.inf
    _followed_s: float = -math.inf
    _filled: bool = False  # the balloon was filled since the last request to hold
    _state: int = BoardState.BOOT.value  # state of the board in the last sample
    _held_s: float = -math.inf  # time of the last sample in the state HOLDING
    _changes: float = 0.0  # state changes above the rate `CHANGES_PER_S`
    _deviating_s: float = 0.0
    _agreeing_s: float = 0.0  # time since the last deviation
    _credible_s: float = 0.0  # time since the last state that contradicts the command or the state before

    @property
    def state_credible(self) -> bool:
        """Return True if the board has reported no contradictory state for `STEADY_S`."""
        return self._credible_s >= STEADY_S

    def request_vent(self, now_s: float) -> None:
        """Ensure that the board receives a vent, even if a hold is requested next."""
        self._restart()
        self.vent_due, self._vent_requested_s = True, now_s

    def request_hold(self) -> None:
        """Reset the monitor for a new hold: the board may empty the balloon before it fills the balloon."""
        self._filled = False
        self._restart()

    def set_command(self, hold: bool, now_s: float) -> None:
        """Store the command that the board receives from now on.

        Samples that were taken before a change of the command are not compared with the new command.
        """
        if hold != self._hold:
            self._hold, self._command_s = hold, now_s
            self._restart()

    def _restart(self) -> None:
        """Restart the time limit because of a request or a new command.

        While a vent is due, the board still receives this vent. Later requests do not extend its time limit.
        """
        if not self.vent_due:
            self._changes = self._deviating_s = self._agreeing_s = 0.0

    def follow(self, state: int, hold: bool, now_s: float) -> bool:
        """Process the state of the board; return False if the board does not follow the command in time.

        A hold may begin with emptying the balloon, which has no time limit. After the balloon was filled,
        emptying is a deviation. A return to HOLDING that no board can make so fast is a deviation, too.
        """
        filled = state in PRESSURISED
        if self.vent_due and not filled and now_s >= self._vent_requested_s + ROUND_TRIP_S:
            self.vent_due = False
            if hold:  # the board receives the hold from now on
                self._restart()
        hold = hold and not self.vent_due
        emptying_first = hold and state == BoardState.VENTING and not self._filled
        changed = state != self._state
        returned = changed and state == BoardState.HOLDING and not now_s >= self._held_s + MIN_REFILL_S
        follows = (filled == hold or emptying_first) and not returned
        passed_s = min(now_s - self._followed_s, MAX_SAMPLE_SPAN_S) if now_s >= self._command_s else 0.0
        self._count(follows, changed, passed_s)
        if follows:
            self._credible_s += passed_s
        elif hold or changed:  # not while the board still holds after a vent command
            self._credible_s = 0.0
        self._followed_s, self._state = now_s, int(state)
        self._held_s = now_s if state == BoardState.HOLDING else self._held_s
        self._filled = self._filled or (filled and hold)
        return self._changes <= MAX_CHANGES and (follows or self._deviating_s <= FOLLOW_S)

    def _count(self, follows: bool, changed: bool, passed_s: float) -> None:
        changes = max(0.0, self._changes - CHANGES_PER_S * passed_s) + changed
        self._changes = min(changes, MAX_CHANGES + 1)
        self._agreeing_s = self._agreeing_s + passed_s if follows else 0.0
        if self._agreeing_s >= STEADY_S:
            self._deviating_s = max(0.0, self._deviating_s - passed_s)
        elif self._deviating_s > 0.0 or not follows:
            self._deviating_s += passed_s
