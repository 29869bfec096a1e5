"""A bench for any board that speaks the rig link: bytes on one side, a pressure on the other."""

import math
import random
from collections import deque

import pytest

from instrument.rig.frames import (
    SAMPLES_PER_S,
    BoardState,
    Command,
    CommandFlag,
    Decoder,
    Event,
    Hello,
    Identify,
    Mode,
    Sample,
    Valve,
    encode,
)
from instrument.rig.limits import HALVED_KPA, HALVING_S
from sim.avr.board import AvrBoard
from sim.board import Board
from tests.firmware.compiled import CBoard
from tests.tools import needs

#: Short enough to run on the emulated board each time; the others do so in `make test-board`.
brief = pytest.mark.brief

DT_S = 1 / SAMPLES_PER_S
ZERO_PA = 250


def sum_at(pressure_kpa):
    """The ADC sum of a pressure, by the data sheet; each of 16 conversions cuts off half a count."""
    return 16384 * (0.018 * (pressure_kpa + ZERO_PA / 1e3) + 0.04) - 8


def hold(setpoint_pa=8000, **more):
    usual = {"mode": Mode.HOLD, "flags": CommandFlag.ZEROED, "zero_pa": ZERO_PA}
    return Command(setpoint_pa=setpoint_pa, **{**usual, **more})


def vent(**more):
    return hold(0, **{"mode": Mode.VENT, **more})


class Bench:
    """A balloon of constant capacity behind slow valves and a laggy tube; knobs break each part."""

    def __init__(self, board, start_us=0):
        self.board = board
        self.now_us = start_us
        self.wanted = None  # the host's command; None: the host is silent
        self.to_send = b""
        self.fill_kpa_per_s = 5.0
        self.vent_s = HALVING_S  #: in which the vent halves 8 kPa; 0 where it is shut
        self.leak_kpa_per_s = 0.0
        self.gas_kpa = 0.0
        self.contact_kpa = 0.0  # what a hand adds
        self.adc_sum = None  # overrides the sensor
        self.supply_mv = 5000
        self.supply_step_mv = getattr(board, "supply_step_mv", 1)  # finer it does not see
        self.frames = []
        self.valve_actions = 0
        self._sensed_kpa = 0.0
        self._late = deque([Valve.NONE] * 6)  # 12 ms
        self._decoder = Decoder.of_board()
        self._random = random.Random(1)
        self._sequence = 0
        self._since_command_s = 1.0

    def switched_on_at(self, pressure_kpa):
        """With gas left in the balloon from before."""
        self.gas_kpa = self._sensed_kpa = pressure_kpa
        return self

    # what the host sees
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

    # time
    def run(self, seconds):
        for _ in range(round(seconds * SAMPLES_PER_S)):
            self.step()
        return self

    def until(self, condition, within_s):
        """Seconds until the condition holds."""
        for n in range(round(within_s * SAMPLES_PER_S)):
            if condition():
                return n * DT_S
            self.step()
        raise AssertionError(f"not within {within_s} s; state {self.state.name}, {self.pressure_kpa:.2f} kPa")

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
        self._late.append(self.board.valves)
        valves = self._late.popleft()
        self.gas_kpa -= self.leak_kpa_per_s * DT_S
        if valves & Valve.INLET_OPEN:
            self.gas_kpa += self.fill_kpa_per_s * DT_S
        if not valves & Valve.VENT_CLOSED and self.vent_s:
            root_fall = math.sqrt(HALVED_KPA) * (1 - math.sqrt(0.5)) * DT_S / self.vent_s
            left = max(math.sqrt(abs(self.gas_kpa)) - root_fall, 0.0)
            self.gas_kpa = math.copysign(left**2, self.gas_kpa)
        self._sensed_kpa += (self.pressure_kpa - self._sensed_kpa) * -math.expm1(-DT_S / 0.06)

    def _convert(self):
        if self.adc_sum is not None:
            return self.adc_sum
        return min(max(round(sum_at(self._sensed_kpa) + self._random.gauss(0, 3)), 0), 16 * 1023)

    def _keep_alive(self):
        self._since_command_s += DT_S
        if self.wanted is None or self._since_command_s < 0.05:
            return b""
        self._since_command_s = 0.0
        return self.frame(self.wanted)

    def frame(self, message, **more):
        self._sequence += 1
        return encode(message, self._sequence, **more)

    # what a host does
    def tell(self, command):
        """From now on keep sending this command."""
        self.wanted = command
        self._since_command_s = 1.0
        return self

    def greet(self):
        self.to_send += self.frame(Identify())
        self.step()
        return self

    def vented(self):
        self.greet().tell(vent()).until_state(BoardState.VENTED, 3)
        self.run(1.0)
        return self

    def inflating(self, setpoint_pa=8000):
        self.vented().tell(hold(setpoint_pa)).until_state(BoardState.INFLATING, 0.2)
        self.run(0.5)
        assert self.state is BoardState.INFLATING
        return self

    def settling(self, setpoint_pa=8000):
        self.inflating(setpoint_pa).until_state(BoardState.SETTLING, 3)
        return self

    def holding(self, setpoint_pa=8000):
        self.vented().tell(hold(setpoint_pa)).until_state(BoardState.HOLDING, 8)
        self.run(0.5)
        return self

    def tripped(self):
        """Tripped by a supply that has come back since."""
        self.holding()
        self.supply_mv = 4000
        self.until_state(BoardState.TRIPPED, 0.1)
        self.supply_mv = 5000
        self.run(2.0)
        return self

    def rests(self, seconds):
        """Nothing moves and nobody looks: ten times as quick."""
        frame, adc_sum = self.frame(self.wanted), self.last().adc_sum
        for n in range(round(seconds * SAMPLES_PER_S)):
            self.now_us += 2000
            self.board.step(self.now_us, adc_sum + n % 2, self.supply_mv, b"" if n % 25 else frame)
        return self

    @property
    def moved_a_valve(self):
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
    """A test of the emulated board alone: run each time."""
    for mark in (*AVR_MARKS, brief):
        test = mark(test)
    return test


@pytest.fixture(
    params=[Board, pytest.param(CBoard, marks=needs("gcc")), pytest.param(AvrBoard, marks=AVR_MARKS)],
    ids=["python", "c", "avr"],
)
def board_type(request):
    """Each board that there is: what is said of a board is said of all."""
    return request.param


def pytest_collection_modifyitems(items):
    for item in items:
        if item.get_closest_marker("avr") and not item.get_closest_marker("brief"):
            item.add_marker("slow")


@pytest.fixture
def bench(board_type):
    return Bench(board_type())
