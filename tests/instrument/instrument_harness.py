"""Test harness that runs an instrument in virtual time, with a simple board or with samples from the test."""

import itertools
import math
from dataclasses import dataclass, field

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.rig.firmware import CURRENT_VERSION, Firmware
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.protocol.frames import BoardKind, BoardState, Hello, Mode, Sample, Valve
from tests.instrument.prepared import prepared_once

DT_S = 0.002
PLC, ROBOT, WEB = ("modbus_tcp", "10.0.0.1"), ("can", ""), ("web", "")
SETPOINT, FORCE_LIMIT = {"setpoint_requested_kpa": 8.0}, {"force_limit_n": 5.0}
VENT, HOLD = {"mode": "vent"}, {"mode": "hold"}
HOLD_8 = HOLD | SETPOINT
KEY = {"command_key": 0x5046}

OUR_FIRMWARE = Firmware(CURRENT_VERSION, IMAGES[CURRENT_VERSION])
FOREIGN_FIRMWARE = Firmware(CURRENT_VERSION, 0xDEADBEEF)  #: image that was not released

TUBE_S = 0.06
MAX_RATE_KPA_PER_S = 20.0


def hello_of(kind=BoardKind.SIMULATED, serial=1):
    return Hello(kind, CURRENT_VERSION, 1000, serial, 250, 2000)


def adc_sum_of(pressure_kpa):
    """Return the sum of 16 conversions at a pressure [kPa], by the transfer function of the MPXV5050."""
    return round(16 * 1024 * (0.018 * pressure_kpa + 0.04) - 8)


@dataclass
class Tube:
    """Balloon and tube. A hand changes the pressure at a limited rate. The sensor follows with a lag."""

    balloon_kpa: float = 0.0
    sensor_kpa: float = 0.0

    def step(self, target_kpa, dt_s=DT_S):
        """Move the balloon towards `target_kpa` and return the pressure at the sensor."""
        max_step_kpa = MAX_RATE_KPA_PER_S * dt_s
        self.balloon_kpa += min(max(target_kpa - self.balloon_kpa, -max_step_kpa), max_step_kpa)
        self.sensor_kpa += (self.balloon_kpa - self.sensor_kpa) * -math.expm1(-dt_s / TUBE_S)
        return self.sensor_kpa


@dataclass
class InstrumentHarness:
    """Instrument with a simple board that follows each command within 0.6 s."""

    instrument: Instrument
    now_s: float = 1000.0
    state: BoardState = BoardState.VENTED
    push_kpa: float = 0.0  #: pressure that a hand adds to the locked pressure
    hand: Tube = field(default_factory=Tube)
    offset_kpa: float = 0.3  #: reading of the sensor at a gauge pressure of zero
    adc_sum: int | None = None  #: replaces the reading of the sensor, unless None
    supply_mv: int = 5000
    causes: set = field(default_factory=set)  #: faults whose cause persists
    latched: set = field(default_factory=set)
    follows_commands: bool = True
    clock_invalid: bool = False
    board_time_us: int = 0
    holding_pa: int = 0
    pressure_kpa: float = 0.0  #: pressure of the balloon without the push of a hand
    settled_s: float = 0.0
    clear: int | None = None
    sent: list = field(default_factory=list)  #: commanded modes in order, without repetitions
    command_sequences: itertools.count = field(default_factory=lambda: itertools.count(1))

    @classmethod
    def new(cls, **settings):
        """Return a harness whose board has identified itself but has sent no samples."""
        harness = cls(Instrument(Settings(**settings)))
        harness.instrument.identify_board(hello_of(), OUR_FIRMWARE)
        return harness

    @classmethod
    @prepared_once
    def zeroed(cls, **settings):
        """Return a vented harness that has completed the zero adjustment."""
        return cls.new(**settings).run(1.2)

    @classmethod
    @prepared_once
    def ready(cls, **settings):
        """Return a zeroed harness that has received a vent command, so that it accepts a hold command."""
        harness = cls.zeroed(**settings)
        harness.write_ok(VENT)
        return harness

    @classmethod
    @prepared_once
    def holding(cls, peer=PLC, request=None, **settings):
        """Return a harness that holds 8 kPa by command of `peer`."""
        harness = cls.ready(**settings)
        harness.write_ok(HOLD_8 | (request or {}), peer)
        return harness.renew(1.0, peer)

    def renew(self, seconds, peer=PLC, request=FORCE_LIMIT):
        """Run for a time and write every 0.1 s, to renew the lease of `peer`."""
        for _ in range(round(seconds / 0.1)):
            self.run(0.1)
            self.write_ok(request, peer)
        return self

    # ---- the board

    def follow_command(self):
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
        elif self.follows_commands:
            self.fill(command.setpoint_pa)

    def fill(self, setpoint_pa):
        if self.holding_pa != setpoint_pa:
            self.state, self.settled_s = BoardState.SETTLING, self.now_s + 0.6
        self.holding_pa, self.pressure_kpa = setpoint_pa, setpoint_pa / 1e3
        if self.now_s >= self.settled_s:
            self.state = BoardState.HOLDING

    @property
    def adc_reading(self):
        if self.adc_sum is not None:
            return self.adc_sum
        pushed_kpa = self.hand.sensor_kpa if self.state is BoardState.HOLDING else 0.0
        return adc_sum_of(self.pressure_kpa + pushed_kpa + self.offset_kpa)

    def sample(self, **changes):
        """Return the current sample of the board, with some fields changed."""
        values = {
            "board_time_us": self.board_time_us,
            "adc_sum": self.adc_reading,
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
        """Pass one sample to the instrument, 2 ms after the previous sample, with some fields changed.

        The board receives no command.
        """
        self.now_s += DT_S
        self.hand.step(self.push_kpa)
        self.board_time_us = (self.board_time_us + 2000) & 0xFFFF_FFFF
        return self.instrument.process(
            RawSample(0, self.now_s, self.sample(**changes), clock_invalid=self.clock_invalid)
        )

    def run(self, seconds, until=None):
        """Send samples and ticks for a time, or until a condition is true.

        The test fails if the condition does not become true in this time.
        """
        for step in range(round(seconds / DT_S)):
            if step % 5 == 0:
                self.instrument.tick(self.now_s)
                self.follow_command()
            self.feed()
            if until and until():
                return self
        assert until is None, "the expected condition did not occur"
        return self

    def set_sensor_push(self, push_kpa):
        """Set a push that the sensor shows immediately, without the lag of the tube."""
        self.push_kpa = push_kpa
        self.hand = Tube(push_kpa, push_kpa)

    def run_without_samples(self, seconds):
        """Send ticks but no samples for a time."""
        for _ in range(round(seconds / 0.01)):
            self.now_s += 0.01
            self.instrument.tick(self.now_s)
        return self

    # ---- the peers

    def write(self, request, peer=PLC):
        """Write as a peer and return the reject reason."""
        return str(self.instrument.write(peer, request, self.now_s))

    def write_ok(self, request, peer=PLC):
        """Write as a peer. The test fails if the write is rejected."""
        assert self.write(request, peer) == "none"

    def snapshot(self, peer=PLC):
        return self.instrument.snapshot(peer, self.now_s)

    def run_command(self, code, argument=0, peer=PLC):
        """Run a command to its end. Return its state and result, or "rejected" and the reject reason."""
        sequence = next(self.command_sequences)
        request = {"command_code": code, "command_argument": argument, "command_sequence": sequence}
        reject_reason = self.write(KEY | request, peer)
        if reject_reason != "none":
            return "rejected", reject_reason
        self.run(1.0, lambda: self.snapshot(peer).answer_state != "busy")
        return self.snapshot(peer).answer_state, str(self.snapshot(peer).answer_result)

    @property
    def commands_hold(self):
        """Return True if the instrument commands the board to inflate or hold."""
        return self.instrument.command().mode == Mode.HOLD
