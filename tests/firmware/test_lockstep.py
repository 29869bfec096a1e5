"""Both boards hear and see the same, and say the same, byte for byte."""

import random

import pytest

from instrument.rig.frames import SAMPLES_PER_S, Command, CommandFlag, Fault, Sample
from sim.board import Board
from tests.firmware.compiled import CBoard
from tests.sim.conftest import ZERO_PA, Bench, hold, vent
from tests.tools import needs

pytestmark = needs("gcc")


class Exact(float):
    """A time that adds up as the firmware's milliseconds do: sums of floats miss thresholds by a sample."""

    def __radd__(self, since_s):
        return round(since_s + float(self), 6)

    def __rsub__(self, left_s):
        return round(left_s - float(self), 6)


@pytest.fixture
def exact_time(monkeypatch):
    monkeypatch.setattr("sim.board.board.SAMPLE_S", Exact(1 / SAMPLES_PER_S))


class Both:
    """Two boards in one place: the first is obeyed, the second must say the same."""

    def __init__(self):
        self.boards = Board(), CBoard()

    @property
    def valves(self):
        in_python, in_c = (board.valves for board in self.boards)
        assert in_python == in_c
        return in_python

    def step(self, *seen):
        in_python, in_c = (board.step(*seen) for board in self.boards)
        assert in_python == in_c, f"at {seen[0]} µs: {in_python.hex(' ')} and {in_c.hex(' ')}"
        return in_python


def contradict(bench, draw):
    """A while with a host that talks nonsense and a rig whose parts break."""
    if draw.random() < 0.1:
        bench.greet()
    if draw.random() < 0.05:
        bench.to_send += draw.randbytes(30)
    bench.contact_kpa = draw.choice([0] * 8 + [1, 5, 12])
    bench.leak_kpa_per_s = draw.choice([0] * 8 + [0.02, 0.4, -0.5])
    bench.fill_kpa_per_s = draw.choice([5] * 9 + [0, 11])
    bench.vent_s = draw.choice([0.55] * 9 + [0, 0.2])
    bench.adc_sum = draw.choice([None] * 16 + [0, 8000])
    bench.supply_mv = draw.choice([5000] * 20 + [4700])
    bench.tell(
        Command(
            mode=draw.choice([0, 0, 1, 1, 1, 1, 9]),
            flags=draw.choice([2, 2, 2, 3, 0, 255]),
            setpoint_pa=draw.choice([0, 1999, 2000, 8000, 12000, 12001, 65535, draw.randrange(2000, 12000)]),
            zero_pa=draw.choice([ZERO_PA] * 6 + [-32768, 32767, 1300]),
            contact_limit_pa=draw.choice([65535, 18000, 12000]),
            vent_after_ms=draw.choice([0, 2000, 65535]),
            clear=draw.choice([0, 1, 2]),
        )
    ).run(draw.choice([0.02, 0.1, 0.1, 1.5, 4]))
    if draw.random() < 0.1:
        bench.wanted = None
        bench.run(draw.choice([0.1, 0.4, 3]))


def faults_seen(seed, whiles):
    """Faults that a lockstep of so many whiles went through."""
    draw, bench = random.Random(seed), Bench(Both()).greet()
    for _ in range(whiles):
        contradict(bench, draw)
    return {sample.fault for sample in bench.all(Sample)}


@pytest.mark.parametrize("seed", [2, 5])
def test_whatever_happens_both_boards_say_the_same(exact_time, seed):
    assert len(faults_seen(seed, whiles=60)) >= 5


PRESSED = CommandFlag.ZEROED | CommandFlag.IN_CONTACT


def leaks(bench):
    bench.holding().leak_kpa_per_s = 0.02
    bench.run(40)
    assert bench.last().fault == Fault.LEAK


def leaks_in_contact(bench):
    bench.holding().tell(hold(flags=PRESSED)).leak_kpa_per_s = 0.02
    bench.run(10).tell(hold()).run(5)


def bursts(bench):
    bench.holding().gas_kpa = 0.0
    bench.run(0.3)
    assert bench.last().fault == Fault.BURST


def is_let_go(bench):
    bench.holding(4000).contact_kpa = 12.0
    bench.run(1).contact_kpa = 0.0
    bench.run(1)


def comes_down(bench):
    bench.holding(12_000).tell(hold(2000)).run(6)


def vents_while_pressed(bench):
    bench.holding().contact_kpa = 4.0
    bench.tell(hold(flags=PRESSED)).run(0.5)
    bench.vent_s, bench.contact_kpa = 0.15, 0.0
    bench.tell(vent(flags=PRESSED)).run(2)


def is_told_before_it_is_greeted(bench):
    bench.tell(hold(vent_after_ms=5000)).run(0.3).greet().run(0.1)


@pytest.mark.parametrize(
    "story",
    [
        leaks,
        leaks_in_contact,
        bursts,
        is_let_go,
        comes_down,
        vents_while_pressed,
        is_told_before_it_is_greeted,
    ],
)
def test_each_story_is_told_in_the_same_bytes(exact_time, story):
    story(Bench(Both()))


@pytest.mark.parametrize("setpoint_pa", [2000, 4950, 8000, 12000])
def test_a_usual_day_is_told_in_the_same_bytes(exact_time, setpoint_pa):
    bench = Bench(Both()).holding(setpoint_pa)
    for contact_kpa in (3.0, 0.0):
        bench.contact_kpa = contact_kpa
        bench.run(1)
