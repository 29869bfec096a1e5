"""Test bench for any board with the rig link: a host on one side, a simulated pressure on the other."""

import math
import random
from collections import deque

import pytest

from pneuforce.protocol.frames import (
    SAMPLES_PER_S,
    BoardState,
    Command,
    CommandFlag,
    Event,
    FrameDecoder,
    Hello,
    Identify,
    Mode,
    Sample,
    Valve,
    encode,
)
from pneuforce.protocol.limits import HALVING_FROM_KPA, HALVING_TIME_S
from pneuforce.sim.avr.board import AvrBoard
from pneuforce.sim.board import SimulatedBoard
from tests.firmware.compiled import CBoard
from tests.tools import needs

#: Mark of tests that are short enough to run on the emulated board in each test run. `make test-board` also
#: runs the other tests on the emulated board.
brief = pytest.mark.brief

DT_S = 1 / SAMPLES_PER_S
ZERO_PA = 250


def sum_at(pressure_kpa):
    """Return the mean ADC sum of a pressure (data sheet). Each of 16 conversions truncates half a count."""
    return 16384 * (0.018 * (pressure_kpa + ZERO_PA / 1e3) + 0.04) - 8


def hold(setpoint_pa=8000, **fields):
    defaults = {"mode": Mode.HOLD, "flags": CommandFlag.ZEROED, "zero_pa": ZERO_PA}
    return Command(setpoint_pa=setpoint_pa, **{**defaults, **fields})


def vent(**fields):
    return hold(0, **{"mode": Mode.VENT, **fields})


class Bench:
    """Balloon of constant capacity behind slow valves and a tube with lag.

    Tests change the attributes to simulate faults.
    """

    def __init__(self, board, start_us=0):
        self.board = board
        self.now_us = start_us
        self.command = None  #: command that the host keeps sending, None if the host is silent
        self.to_send = b""
        self.fill_kpa_per_s = 5.0
        self.halving_s = HALVING_TIME_S  #: time in which the vent halves 8 kPa, 0 if the vent is shut
        self.leak_kpa_per_s = 0.0
        self.gas_kpa = 0.0
        self.contact_kpa = 0.0  #: pressure added by a contact
        self.adc_sum = None  #: ADC sum that replaces the reading of the sensor, or None
        self.supply_mv = 5000
        self.supply_step_mv = getattr(board, "supply_step_mv", 1)  #: resolution of the supply measurement
        self.frames = []
        self.valve_actions = 0
        self._sensed_kpa = 0.0
        self._valve_delay = deque([Valve.NONE] * 6)  # a valve moves after 12 ms
        self._decoder = FrameDecoder.for_board_frames()
        self._random = random.Random(1)
        self._sequence = 0
        self._since_command_s = 1.0

    def switched_on_at(self, pressure_kpa):
        """Set the balloon pressure [kPa] at which the board is switched on."""
        self.gas_kpa = self._sensed_kpa = pressure_kpa
        return self

    # messages that the host receives

    def last(self, kind=Sample):
        return next(f.message for f in reversed(self.frames) if isinstance(f.message, kind))

    def all(self, kind):
        return [f.message for f in self.frames if isinstance(f.message, kind)]

    @property
    def state(self):
        return BoardState(self.last().state)

    @property
    def pressure_kpa(self):
        return self.gas_kpa + self.contact_kpa

    # simulated time

    def run(self, seconds):
        for _ in range(round(seconds * SAMPLES_PER_S)):
            self.step()
        return self

    def until(self, condition, within_s):
        """Run until the condition is true. Return the elapsed seconds."""
        for n in range(round(within_s * SAMPLES_PER_S)):
            if condition():
                return n * DT_S
            self.step()
        pressure = f"{self.pressure_kpa:.2f} kPa"
        raise AssertionError(f"not true within {within_s} s; state {self.state.name}, {pressure}")

    def until_state(self, state, within_s):
        return self.until(lambda: self.state is state, within_s)

    def step(self):
        self.now_us += 2000
        before = self.board.valves
        self._flow()
        received = self.to_send + self._keep_alive()
        self.to_send = b""
        sent = self.board.step(self.now_us, self._convert(), self.supply_mv, received)
        self.frames += self._decoder.feed(sent)
        self.valve_actions += self.board.valves != before

    def _flow(self):
        self._valve_delay.append(self.board.valves)
        valves = self._valve_delay.popleft()
        self.gas_kpa -= self.leak_kpa_per_s * DT_S
        if valves & Valve.INLET_OPEN:
            self.gas_kpa += self.fill_kpa_per_s * DT_S
        if not valves & Valve.VENT_CLOSED and self.halving_s:
            root_fall = math.sqrt(HALVING_FROM_KPA) * (1 - math.sqrt(0.5)) * DT_S / self.halving_s
            left = max(math.sqrt(abs(self.gas_kpa)) - root_fall, 0.0)
            self.gas_kpa = math.copysign(left**2, self.gas_kpa)
        self._sensed_kpa += (self.pressure_kpa - self._sensed_kpa) * -math.expm1(-DT_S / 0.06)

    def _convert(self):
        if self.adc_sum is not None:
            return self.adc_sum
        return min(max(round(sum_at(self._sensed_kpa) + self._random.gauss(0, 3)), 0), 16 * 1023)

    def _keep_alive(self):
        self._since_command_s += DT_S
        if self.command is None or self._since_command_s < 0.05:
            return b""
        self._since_command_s = 0.0
        return self.frame(self.command)

    def frame(self, message, **header):
        self._sequence += 1
        return encode(message, self._sequence, **header)

    # messages that the host sends

    def keep_sending(self, command):
        """Send this command now and every 50 ms."""
        self.command = command
        self._since_command_s = 1.0
        return self

    def identify(self):
        self.to_send += self.frame(Identify())
        self.step()
        return self

    def vented(self):
        self.identify().keep_sending(vent()).until_state(BoardState.VENTED, 3)
        self.run(1.0)
        return self

    def inflating(self, setpoint_pa=8000):
        self.vented().keep_sending(hold(setpoint_pa)).until_state(BoardState.INFLATING, 0.2)
        self.run(0.5)
        assert self.state is BoardState.INFLATING
        return self

    def settling(self, setpoint_pa=8000):
        self.inflating(setpoint_pa).until_state(BoardState.SETTLING, 3)
        return self

    def holding(self, setpoint_pa=8000):
        self.vented().keep_sending(hold(setpoint_pa)).until_state(BoardState.HOLDING, 8)
        self.run(0.5)
        return self

    def tripped(self):
        """Trip the board by a low supply voltage, then restore the voltage."""
        self.holding()
        self.supply_mv = 4000
        self.until_state(BoardState.TRIPPED, 0.1)
        self.supply_mv = 5000
        self.run(2.0)
        return self

    def idle(self, seconds):
        """Run with a constant pressure and without decoding frames, which is ten times as fast as `run`."""
        frame, adc_sum = self.frame(self.command), self.last().adc_sum
        for n in range(round(seconds * SAMPLES_PER_S)):
            self.now_us += 2000
            self.board.step(self.now_us, adc_sum + n % 2, self.supply_mv, b"" if n % 25 else frame)
        return self

    @property
    def valve_moved(self):
        return any(s.valves != Valve.NONE for s in self.all(Sample))

    def __repr__(self):
        return f"<Bench {self.all(Hello)[-1:]} {self.all(Event)}>"


AVR_MARKS = [
    pytest.mark.avr,
    needs("gcc"),
    needs("gcc-avr", "/usr/bin/avr-gcc"),
    needs("avr-libc", "/usr/lib/avr/include/avr/io.h"),
    needs("libsimavr-dev", "/usr/include/simavr"),
]


def emulated(test):
    """Mark a test that uses the emulated board only and runs in each test run."""
    for mark in (*AVR_MARKS, brief):
        test = mark(test)
    return test


@pytest.fixture(
    params=[
        SimulatedBoard,
        pytest.param(CBoard, marks=needs("gcc")),
        pytest.param(AvrBoard, marks=AVR_MARKS),
    ],
    ids=["python", "c", "avr"],
)
def board_type(request):
    """Run the test on every implementation of the board."""
    return request.param


def pytest_collection_modifyitems(items):
    for item in items:
        if item.get_closest_marker("avr") and not item.get_closest_marker("brief"):
            item.add_marker("slow")


@pytest.fixture
def bench(board_type):
    return Bench(board_type())
