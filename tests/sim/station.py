"""A simulated world and the real instrument on it, in virtual time: link, core, and a host that beats."""

from instrument.core import Instrument
from instrument.errors import ProtocolMismatch
from instrument.rig.frames import Fault
from instrument.rig.link import Link, Phase
from instrument.settings import Settings
from sim.board import Board
from sim.hand import Hand
from sim.rig import STEP_S, Rig
from sim.world import World

PLC = ("modbus_tcp", "10.0.0.1")
BEAT_STEPS = 5


class Station:
    """What `pneuforce run` does with its port, at the pace of the simulation."""

    def __init__(self, plant, schedule=None, new_board=Board, **settings):
        self.world = World(Rig(plant, Hand(False), new_board=new_board), schedule)
        self.instrument = Instrument(Settings(**settings))
        self.link = Link(round(self.instrument.settings.vent_after_s * 1e3))
        self.refused = None  #: what the greeting ended with
        self.used = 0  #: samples used
        self._restarts = 0
        self._heard_s = 0.0
        self._steps = 0

    @property
    def now_s(self):
        return 1000.0 + self.world.now_s

    def step(self):
        self._steps += 1
        to_board = self._beat() if self._steps % BEAT_STEPS == 0 else b""
        self._hear(self.world.step(to_board))

    def _beat(self):
        self.instrument.tick(self.now_s)
        if self.now_s > self._heard_s + 0.3 and self.link.phase is Phase.READY:
            self.link.restart()
        return self.link.tick(self.instrument.command(), self.now_s)

    def _hear(self, data):
        try:
            samples = self.link.feed(data, self.now_s)
        except ProtocolMismatch as error:
            self.refused = error
            self.link.forget()
            self.instrument.disconnected()
            return
        if self.link.board_restarts != self._restarts:
            self._restarts = self.link.board_restarts
            self.instrument.board_restarted()
        if samples and self.link.hello:
            self.instrument.greeted(self.link.hello)
            self._heard_s = self.now_s
        self.used += len(samples)
        for sample in samples:
            self.instrument.take(sample)

    def run(self, seconds, until=lambda: False):
        """Go on for a time, or until something is so; whether it was so."""
        for _ in range(round(seconds / STEP_S)):
            if until():
                return True
            self.step()
        return until()

    # what is asked and seen

    def ask(self, **request):
        assert self.instrument.write(PLC, request, self.now_s) == "none"

    def see(self):
        return self.instrument.snapshot(PLC, self.now_s)

    @property
    def latched(self):
        """What the board itself has latched."""
        now = self.world.rig.board._pressure.now
        return {Fault(code) for code in now.latched}

    # where a fault can be put in

    def vented(self):
        assert self.run(8, lambda: self.instrument.chain.zero.taken)
        self.ask(mode="vent")
        return self

    def inflating(self, setpoint_kpa=8.0):
        self.vented().ask(mode="hold", setpoint_requested_kpa=setpoint_kpa)
        assert self.run(2, lambda: self.world.rig.truth.balloon_kpa > 2.0)
        return self

    def holding(self, setpoint_kpa=8.0):
        self.inflating(setpoint_kpa)
        assert self.run(8, lambda: self.see().state == "holding")
        self.run(1.0)
        return self
