"""A solenoid valve behind its relay: it moves late, and it may be stuck."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from sim.pneumatics.flow import Orifice

_ROUNDING_S = 1e-9


@dataclass(slots=True)
class SolenoidValve:
    """One of the two valves, in terms of what the gas sees: open or shut."""

    orifice: Orifice
    opening_s: float  #: from the order to the open valve, relay included
    closing_s: float
    told_open: bool
    stuck: bool | None = None  #: None works, True is stuck open, False stuck shut
    _open: bool = field(init=False)
    _coming: deque[tuple[float, bool]] = field(default_factory=deque)  # (time left [s], open)

    def __post_init__(self) -> None:
        """It has been told long ago."""
        self._open = self.told_open

    @property
    def open(self) -> bool:
        """Whether gas can pass now."""
        return self._open if self.stuck is None else self.stuck

    def step(self, told_open: bool, dt_s: float) -> None:
        """Move for `dt_s`, being told to be open or shut. A pulse is delayed whole."""
        if told_open != self.told_open:
            self.told_open = told_open
            self._coming.append((self.opening_s if told_open else self.closing_s, told_open))
        if self._coming:
            self._coming = deque((left_s - dt_s, state) for left_s, state in self._coming)
            while self._coming and self._coming[0][0] <= _ROUNDING_S:
                self._open = self._coming.popleft()[1]
