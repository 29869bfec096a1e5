"""Drives the core in virtual time: samples made by hand, or by a board that obeys at once."""

import itertools
import math
from dataclasses import dataclass, field

from instrument.core import Instrument
from instrument.rig.frames import BoardKind, BoardState, Hello, Mode, Sample, Valve
from instrument.rig.link import RawSample
from instrument.settings import Settings

DT_S = 0.002
PLC, ROBOT, PAGE = ("modbus_tcp", "10.0.0.1"), ("can", ""), ("page", "")
SETPOINT, FORCE_LIMIT = {"setpoint_requested_kpa": 8.0}, {"force_limit_n": 5.0}
VENT, HOLD = {"mode": "vent"}, {"mode": "hold"}
HOLD_8 = HOLD | SETPOINT
KEY = {"command_key": 0x5046}


def adc_sum_of(pressure_kpa):
    """Sum of 16 conversions that reads as a pressure [kPa], by the MPXV5050's transfer function."""
    return round(16 * 1024 * (0.018 * pressure_kpa + 0.04) - 8)


TUBE_S = 0.06
STEEPEST_KPA_PER_S = 20.0


@dataclass
class Tube:
    """No pressure jumps: a hand takes its time, and the tube from the balloon to the sensor lags."""

    balloon_kpa: float = 0.0
    sensor_kpa: float = 0.0

    def step(self, target_kpa, dt_s=DT_S):
        most_kpa = STEEPEST_KPA_PER_S * dt_s
        self.balloon_kpa += min(max(target_kpa - self.balloon_kpa, -most_kpa), most_kpa)
        self.sensor_kpa += (self.balloon_kpa - self.sensor_kpa) * -math.expm1(-dt_s / TUBE_S)
        return self.sensor_kpa


@dataclass
class Drive:
    """An instrument and the board that it talks to."""

    instrument: Instrument
    now_s: float = 1000.0
    state: BoardState = BoardState.VENTED
    push_kpa: float = 0.0  #: what a hand adds to the locked pressure
    hand: Tube = field(default_factory=Tube)
    offset_kpa: float = 0.3  #: the sensor's own zero
    adc_sum: int | None = None  #: overrides what the sensor reads
    supply_mv: int = 5000
    causes: set = field(default_factory=set)  #: faults whose cause lasts
    latched: set = field(default_factory=set)
    obeys: bool = True
    frozen: bool = False
    board_time_us: int = 0
    holding_pa: int = 0
    pressure_kpa: float = 0.0  #: of the balloon without a hand
    settled_s: float = 0.0
    clear: int | None = None
    sent: list = field(default_factory=list)  #: modes commanded, in order
    orders: itertools.count = field(default_factory=lambda: itertools.count(1))

    @classmethod
    def new(cls, **settings):
        drive = cls(Instrument(Settings(**settings)))
        drive.instrument.greeted(Hello(BoardKind.SIMULATED, 0x100, 1000, 1, 250, 2000))
        return drive

    @classmethod
    def zeroed(cls, **settings):
        return cls.new(**settings).run(1.2)

    @classmethod
    def ready(cls, **settings):
        drive = cls.zeroed(**settings)
        drive.must(VENT)
        return drive

    @classmethod
    def holding(cls, peer=PLC, request=None, **settings):
        drive = cls.ready(**settings)
        drive.must(HOLD_8 | (request or {}), peer)
        return drive.renew(1.0, peer)

    def renew(self, seconds, peer=PLC, request=FORCE_LIMIT):
        """Run, and write again and again as the holder of a lease must."""
        for _ in range(round(seconds / 0.1)):
            self.run(0.1)
            self.must(request, peer)
        return self

    # ---- the board

    def obey(self):
        command = self.instrument.command()
        if not self.sent or self.sent[-1] != command.mode:
            self.sent.append(command.mode)
        if self.clear not in (None, command.clear):
            self.latched &= self.causes
        self.clear = command.clear
        self.latched |= self.causes
        if self.latched or command.mode == Mode.VENT:
            self.state = BoardState.TRIPPED if self.latched else BoardState.VENTED
            self.holding_pa, self.pressure_kpa = 0, 0.0
        elif self.obeys:
            self.fill(command.setpoint_pa)

    def fill(self, setpoint_pa):
        if self.holding_pa != setpoint_pa:
            self.state, self.settled_s = BoardState.SETTLING, self.now_s + 0.6
        self.holding_pa, self.pressure_kpa = setpoint_pa, setpoint_pa / 1e3
        if self.now_s >= self.settled_s:
            self.state = BoardState.HOLDING

    @property
    def reading(self):
        if self.adc_sum is not None:
            return self.adc_sum
        pushed_kpa = self.hand.sensor_kpa if self.state is BoardState.HOLDING else 0.0
        return adc_sum_of(self.pressure_kpa + pushed_kpa + self.offset_kpa)

    def sample(self, **changes):
        values = {
            "board_time_us": self.board_time_us,
            "adc_sum": self.reading,
            "supply_mv": self.supply_mv,
            "valves": Valve.VENT_CLOSED if self.holding_pa else Valve.NONE,
            "state": self.state,
            "fault": min(self.latched, default=0),
            "faults": sum(1 << fault for fault in self.latched),
            "command": 0,
            "setpoint_pa": self.holding_pa,
        }
        return Sample(**(values | changes))

    def feed(self, **changes):
        """One sample by hand, 2 ms later; the board does nothing."""
        self.now_s += DT_S
        self.hand.step(self.push_kpa)
        self.board_time_us = (self.board_time_us + 2000) & 0xFFFF_FFFF
        return self.instrument.take(RawSample(0, self.now_s, self.sample(**changes), frozen=self.frozen))

    def run(self, seconds, until=None):
        """Samples and ticks for a time, or until something is so."""
        for step in range(round(seconds / DT_S)):
            if step % 5 == 0:
                self.instrument.tick(self.now_s)
                self.obey()
            self.feed()
            if until and until():
                return self
        assert until is None, "what was waited for did not come"
        return self

    def hit(self, push_kpa):
        """A pressure that the sensor shows at once: a blow on the tube itself."""
        self.push_kpa = push_kpa
        self.hand = Tube(push_kpa, push_kpa)

    def silence(self, seconds):
        """Ticks without samples."""
        for _ in range(round(seconds / 0.01)):
            self.now_s += 0.01
            self.instrument.tick(self.now_s)
        return self

    # ---- those who ask

    def write(self, request, peer=PLC):
        return str(self.instrument.write(peer, request, self.now_s))

    def must(self, request, peer=PLC):
        assert self.write(request, peer) == "none"

    def see(self, peer=PLC):
        return self.instrument.snapshot(peer, self.now_s)

    def order(self, code, argument=0, peer=PLC):
        """Run a command to its end; its state and result."""
        request = {"command_code": code, "command_argument": argument, "command_sequence": next(self.orders)}
        refusal = self.write(KEY | request, peer)
        if refusal != "none":
            return "refused", refusal
        self.run(1.0, lambda: self.see(peer).answer_state != "busy")
        return self.see(peer).answer_state, str(self.see(peer).answer_result)

    @property
    def inflates(self):
        return self.instrument.command().mode == Mode.HOLD
