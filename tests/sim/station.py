"""Real instrument and real link, connected to a simulated rig in virtual time."""

from pneuforce.errors import ProtocolMismatch
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.rig.link import Link, LinkPhase
from pneuforce.protocol.frames import Fault
from pneuforce.sim.board import SimulatedBoard
from pneuforce.sim.hand import Hand
from pneuforce.sim.rig import STEP_S, Rig
from pneuforce.sim.world import World

PLC = ("modbus_tcp", "10.0.0.1")
TICK_STEPS = 5


class Station:
    """Replacement for the process of `pneuforce run`, without a port. Each step simulates 2 ms."""

    def __init__(self, plant, schedule=None, new_board=SimulatedBoard, **settings):
        self.world = World(Rig(plant, Hand(False), new_board=new_board), schedule)
        self.instrument = Instrument(Settings(**settings))
        self.link = Link(round(self.instrument.settings.host_timeout_s * 1e3))
        self.rejection = None  #: ProtocolMismatch if the host has rejected the board, otherwise None
        self.used_samples = 0  #: samples that the instrument has received
        self._restarts = 0
        self._last_sample_s = 0.0
        self._steps = 0

    @property
    def now_s(self):
        return 1000.0 + self.world.now_s

    def step(self):
        self._steps += 1
        to_board = self._tick() if self._steps % TICK_STEPS == 0 else b""
        self._receive(self.world.step(to_board))

    def _tick(self):
        self.instrument.tick(self.now_s)
        if self.now_s > self._last_sample_s + 0.3 and self.link.phase is LinkPhase.READY:
            self.link.restart()
        return self.link.tick(self.instrument.command(), self.now_s)

    def _receive(self, data):
        try:
            samples = self.link.feed(data, self.now_s)
        except ProtocolMismatch as error:
            self.rejection = error
            self.link.clear_hello()
            self.instrument.disconnected()
            return
        if self.link.board_restarts != self._restarts:
            self._restarts = self.link.board_restarts
            self.instrument.board_restarted()
        if samples and self.link.hello:
            self.instrument.identify_board(self.link.hello, self.link.firmware)
            self._last_sample_s = self.now_s
        self.used_samples += len(samples)
        for sample in samples:
            self.instrument.process(sample)

    def run(self, seconds, until=lambda: False):
        """Run for a time, or until the condition is true. Return True if the condition is true."""
        for _ in range(round(seconds / STEP_S)):
            if until():
                return True
            self.step()
        return until()

    # requests to the instrument, and results

    def write(self, **request):
        assert self.instrument.write(PLC, request, self.now_s) == "none"

    def snapshot(self):
        return self.instrument.snapshot(PLC, self.now_s)

    @property
    def latched_faults(self):
        """Return the faults that the board itself has latched."""
        return {Fault(code) for code in self.world.rig.board._pressure.status.latched_faults}

    # phases in which a fault can be injected

    def vented(self):
        assert self.run(8, lambda: self.instrument.chain.zero.taken)
        self.write(mode="vent")
        return self

    def inflating(self, setpoint_kpa=8.0):
        self.vented().write(mode="hold", setpoint_requested_kpa=setpoint_kpa)
        assert self.run(2, lambda: self.world.rig.truth.balloon_kpa > 2.0)
        return self

    def holding(self, setpoint_kpa=8.0):
        self.inflating(setpoint_kpa)
        assert self.run(8, lambda: self.snapshot().state == "holding")
        self.run(1.0)
        return self
