"""Obedience: whether the board does what it was told, as its samples show."""

from __future__ import annotations

import math
from dataclasses import dataclass

from instrument.rig.frames import BoardState
from instrument.rig.limits import PRESSURISED
from instrument.rig.link import BRIDGED_S

OBEY_S = 1.0  #: how long the board may take to begin to fill, or to empty, when told to
HEARD_S = 0.05  #: a command is sent, heard and seen in the samples within this time


@dataclass(slots=True)
class Obedience:
    """Follows the board's state after each vent and each hold that was asked."""

    vent_owed: bool = False  #: a vent was asked and is not yet seen: until then nothing else is told
    _told: bool = False  # to hold
    _told_s: float = -math.inf
    _vent_asked_s: float = -math.inf
    _disobeyed_s: float = 0.0
    _followed_s: float = -math.inf
    _filled: bool = False  # since "hold" was asked

    def ask_vent(self, now_s: float) -> None:
        """A filled balloon is to be vented, whatever is asked right after."""
        self.vent_owed, self._vent_asked_s = True, now_s

    def ask_hold(self) -> None:
        """A vented balloon is to be filled."""
        self._filled = False

    def tell(self, hold: bool, now_s: float) -> None:
        """What the board is told from now on: what it did before that proves nothing."""
        if hold != self._told:
            self._told, self._told_s = hold, now_s

    def follow(self, state: int, hold: bool, now_s: float) -> bool:
        """Note the board's state and what it is told; False where it has not obeyed in time.

        Emptying first takes as long as it takes; a balloon that was filled has no reason to empty.
        """
        filled = state in PRESSURISED
        self.vent_owed = self.vent_owed and (filled or not now_s >= self._vent_asked_s + HEARD_S)
        hold = hold and not self.vent_owed
        emptying_first = hold and state == BoardState.VENTING and not self._filled
        obeys = filled == hold or emptying_first
        passed_s = min(now_s - self._followed_s, BRIDGED_S) if now_s >= self._told_s else 0.0
        self._disobeyed_s = 0.0 if obeys else self._disobeyed_s + passed_s
        self._followed_s = now_s
        self._filled = self._filled or (filled and hold)
        return self._disobeyed_s <= OBEY_S
