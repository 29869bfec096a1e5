"""Whether the locked balloon loses gas, by the slope of its free pressure: seen before the board gives up."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

#: At a new setpoint latex creeps and gas cools for so long.
CREEP_S = 60.0
#: The slope is that of a minute without contact, in pieces: a top-up or a contact costs the piece it is in.
PIECE_S, PIECES = 10.0, 6
#: Three top-ups of 0.14 kPa in ten minutes make up for this; beyond that the board trips.
LEAK_KPA_PER_S = 0.0007


@dataclass(slots=True)
class LeakWatch:
    """Follows the baseline at one setpoint."""

    seen: bool = False  #: it falls faster than the board can top up for long
    _setpoint_pa: int = 0
    _free_s: float = 0.0
    _piece_s: float = 0.0
    _from_kpa: float = 0.0
    _falls_kpa: deque[float] = field(default_factory=lambda: deque(maxlen=PIECES))

    def step(self, setpoint_pa: int, free: bool, baseline_kpa: float, dt_s: float) -> None:
        """One sample later. `free`: locked and without contact; else nothing is learned."""
        if setpoint_pa != self._setpoint_pa:
            self._restart(setpoint_pa)
        if not free:
            self._piece_s = 0.0
            return
        if self._piece_s == 0:
            self._from_kpa = baseline_kpa
        self._free_s += dt_s
        self._piece_s += dt_s
        if self._piece_s >= PIECE_S:
            self._piece_s = 0.0
            self._judge(self._from_kpa - baseline_kpa)

    def _judge(self, fall_kpa: float) -> None:
        if self._free_s > CREEP_S:
            self._falls_kpa.append(fall_kpa)
        whole = len(self._falls_kpa) == PIECES
        self.seen = whole and sum(self._falls_kpa) > LEAK_KPA_PER_S * PIECE_S * PIECES

    def _restart(self, setpoint_pa: int) -> None:
        self._setpoint_pa = setpoint_pa
        self.seen, self._free_s, self._piece_s = False, 0.0, 0.0
        self._falls_kpa.clear()
