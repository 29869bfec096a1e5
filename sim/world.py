"""All that is simulated, in virtual time: the rig, the line to the host, and the faults of both."""

from __future__ import annotations

from sim.faults import Faults, Schedule
from sim.rig import STEP_S, Rig
from sim.serial_line import SerialLine


class World:
    """A rig at the end of a line, and what goes wrong with them."""

    def __init__(self, rig: Rig, schedule: Schedule | None = None) -> None:
        self.rig = rig
        self.line = SerialLine()
        self.faults = Faults(self)
        self.now_s = 0.0
        self._schedule = schedule or Schedule(())

    def step(self, received: bytes = b"") -> bytes:
        """What the host hears 2 ms later, having sent these bytes."""
        self.now_s += STEP_S
        self._schedule.step(self.faults, self.now_s)
        heard = self.line.to_board(received, self.now_s)
        return self.line.to_host(self.rig.step(heard), self.now_s)
