"""Obedience: whether the board does what it was told, as its samples show."""

from __future__ import annotations

import math
from dataclasses import dataclass

from instrument.rig.frames import BoardState

FILLED = frozenset({BoardState.INFLATING, BoardState.SETTLING, BoardState.HOLDING})
OBEY_S = 1.0  #: how long the board may take to leave the vented state when told to hold
HEARD_S = 0.05  #: a command is sent, heard and seen in the samples within this time


@dataclass(slots=True)
class Obedience:
    """Follows the board's state after each vent and each hold that was asked."""

    vent_owed: bool = False  #: a vent was asked and is not yet seen: until then nothing else is told
    _vent_asked_s: float = -math.inf
    _obeyed_s: float = math.inf
    _filled: bool = False  # since "hold" was asked

    def ask_vent(self, now_s: float) -> None:
        """A filled balloon is to be vented, whatever is asked right after."""
        self.vent_owed, self._vent_asked_s = True, now_s

    def ask_hold(self, now_s: float) -> None:
        """A vented balloon is to be filled."""
        self._obeyed_s, self._filled = now_s, False

    def follow(self, state: int, now_s: float) -> bool:
        """Note the board's state; False where a board that was told to hold has not obeyed in time.

        Emptying first takes as long as it takes; a balloon that was filled has no reason to empty.
        """
        filled = state in FILLED
        self.vent_owed = self.vent_owed and (filled or not now_s >= self._vent_asked_s + HEARD_S)
        emptying_first = state == BoardState.VENTING and not self._filled
        if filled or emptying_first or self.vent_owed:
            self._obeyed_s = now_s
        self._filled = self._filled or (filled and not self.vent_owed)
        return now_s <= self._obeyed_s + OBEY_S
