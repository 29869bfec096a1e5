"""Solenoid valve with its relay: it follows commands with a delay, and can be stuck."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from pneuforce.sim.pneumatics.flow import Orifice

_ROUNDING_S = 1e-9


@dataclass(slots=True)
class SolenoidValve:
    """Solenoid valve that is either fully open or fully shut."""

    orifice: Orifice
    opening_s: float  #: delay from the command to the open valve, including the relay
    closing_s: float  #: delay from the command to the shut valve, including the relay
    commanded_open: bool
    stuck: bool | None = None  #: None: the valve works; True: stuck open; False: stuck shut
    _open: bool = field(init=False)
    _pending: deque[tuple[float, bool]] = field(default_factory=deque)  # (remaining delay [s], True to open)

    def __post_init__(self) -> None:
        """Start in the commanded position."""
        self._open = self.commanded_open

    @property
    def open(self) -> bool:
        """Return True if gas can pass now."""
        return self._open if self.stuck is None else self.stuck

    def step(self, commanded_open: bool, dt_s: float) -> None:
        """Advance the time by `dt_s` under a command. Short pulses are delayed, not shortened."""
        if commanded_open != self.commanded_open:
            self.commanded_open = commanded_open
            self._pending.append((self.opening_s if commanded_open else self.closing_s, commanded_open))
        if self._pending:
            self._pending = deque((left_s - dt_s, state) for left_s, state in self._pending)
            while self._pending and self._pending[0][0] <= _ROUNDING_S:
                self._open = self._pending.popleft()[1]
