"""Complete simulation in virtual time: rig, serial line to the host, and the faults of both."""

from __future__ import annotations

from pneuforce.sim.faults import FaultInjector, FaultSchedule
from pneuforce.sim.line.serial_line import SerialLine
from pneuforce.sim.rig import STEP_S, Rig


class World:
    """Rig with its serial line to the host, and with injected and scheduled faults."""

    def __init__(self, rig: Rig, schedule: FaultSchedule | None = None) -> None:
        self.rig = rig
        self.line = SerialLine()
        self.faults = FaultInjector(self)
        self.now_s = 0.0
        self._schedule = schedule or FaultSchedule(())

    def step(self, received: bytes = b"") -> bytes:
        """Advance the simulation by 2 ms. Return the bytes that the host receives.

        `received` are the bytes that the host has sent since the last step.
        """
        self.now_s += STEP_S
        self._schedule.step(self.faults, self.now_s)
        to_board = self.line.to_board(received, self.now_s)
        return self.line.to_host(self.rig.step(to_board), self.now_s)
