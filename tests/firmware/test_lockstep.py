"""Lockstep tests: the Python board and the C board send the same bytes for the same inputs."""

import random

import pytest

from pneuforce.protocol.frames import SAMPLES_PER_S, BoardState, Command, CommandFlag, Fault, Sample
from pneuforce.sim.board import SimulatedBoard
from tests.firmware.compiled import CBoard
from tests.sim.conftest import ZERO_PA, Bench, hold, vent
from tests.tools import needs

pytestmark = needs("gcc")


class Exact(float):
    """Time in seconds without rounding errors in sums.

    The firmware counts whole milliseconds. Sums of floats would reach a threshold one sample earlier or
    later.
    """

    def __radd__(self, since_s):
        return round(since_s + float(self), 6)

    def __rsub__(self, left_s):
        return round(left_s - float(self), 6)


@pytest.fixture
def exact_time(monkeypatch):
    monkeypatch.setattr("pneuforce.sim.board.board.SAMPLE_S", Exact(1 / SAMPLES_PER_S))


class Both:
    """Python board and C board with the same inputs. Their outputs must be equal."""

    def __init__(self):
        self.boards = SimulatedBoard(), CBoard()

    @property
    def valves(self):
        in_python, in_c = (board.valves for board in self.boards)
        assert in_python == in_c
        return in_python

    def step(self, *inputs):
        in_python, in_c = (board.step(*inputs) for board in self.boards)
        assert in_python == in_c, f"at {inputs[0]} µs: {in_python.hex(' ')} and {in_c.hex(' ')}"
        return in_python


def run_random_period(bench, draw):
    """Run for a random time. The host sends random commands, and the rig has random faults."""
    if draw.random() < 0.1:
        bench.identify()
    if draw.random() < 0.05:
        bench.to_send += draw.randbytes(30)
    bench.contact_kpa = draw.choice([0] * 8 + [1, 5, 12])
    bench.leak_kpa_per_s = draw.choice([0] * 8 + [0.02, 0.4, -0.5])
    bench.fill_kpa_per_s = draw.choice([5] * 9 + [0, 11])
    bench.halving_s = draw.choice([0.55] * 9 + [0, 0.2])
    bench.adc_sum = draw.choice([None] * 16 + [0, 8000])
    bench.supply_mv = draw.choice([5000] * 20 + [4700])
    bench.keep_sending(
        Command(
            mode=draw.choice([0, 0, 1, 1, 1, 1, 9]),
            flags=draw.choice([2, 2, 2, 3, 0, 255]),
            setpoint_pa=draw.choice([0, 1999, 2000, 8000, 12000, 12001, 65535, draw.randrange(2000, 12000)]),
            zero_pa=draw.choice([ZERO_PA] * 6 + [-32768, 32767, 1300]),
            contact_limit_pa=draw.choice([65535, 18000, 12000]),
            host_timeout_ms=draw.choice([0, 2000, 65535]),
            clear=draw.choice([0, 1, 2]),
            proof_test=draw.choice([0, 0, 1, 2]),
        )
    ).run(draw.choice([0.02, 0.1, 0.1, 1.5, 4]))
    if draw.random() < 0.1:
        bench.command = None
        bench.run(draw.choice([0.1, 0.4, 3]))


def faults_seen(seed, periods):
    """Run both boards for random periods. Return the faults that occurred."""
    draw, bench = random.Random(seed), Bench(Both()).identify()
    for _ in range(periods):
        run_random_period(bench, draw)
    return {sample.fault for sample in bench.all(Sample)}


@pytest.mark.parametrize("seed", [2, 5])
def test_both_boards_send_the_same_bytes_for_random_inputs(exact_time, seed):
    assert len(faults_seen(seed, periods=60)) >= 5


PRESSED = CommandFlag.ZEROED | CommandFlag.IN_CONTACT


def leaks(bench):
    bench.holding().leak_kpa_per_s = 0.02
    bench.run(40)
    assert bench.last().fault == Fault.LEAK


def leaks_in_contact(bench):
    bench.holding().keep_sending(hold(flags=PRESSED)).leak_kpa_per_s = 0.02
    bench.run(10).keep_sending(hold()).run(5)


def bursts(bench):
    bench.holding().gas_kpa = 0.0
    bench.run(0.3)
    assert bench.last().fault == Fault.BURST


def is_released(bench):
    bench.holding(4000).contact_kpa = 12.0
    bench.run(1).contact_kpa = 0.0
    bench.run(1)


def comes_down(bench):
    bench.holding(12_000).keep_sending(hold(2000)).run(6)


def vents_while_pressed(bench):
    bench.holding().contact_kpa = 4.0
    bench.keep_sending(hold(flags=PRESSED)).run(0.5)
    bench.halving_s, bench.contact_kpa = 0.15, 0.0
    bench.keep_sending(vent(flags=PRESSED)).run(2)


def checks_its_tube(bench):
    bench.holding().keep_sending(hold(proof_test=1)).run(1.0)
    assert any(sample.state == BoardState.TESTING for sample in bench.all(Sample))
    bench.fill_kpa_per_s = 0.0
    bench.keep_sending(hold(proof_test=2)).run(1.0)
    bench.fill_kpa_per_s, bench.gas_kpa = 5.0, 8.08
    bench.run(0.5).keep_sending(hold(proof_test=3)).run(1.0)
    bench.keep_sending(hold(proof_test=4)).run(0.1).keep_sending(vent()).run(2.0)


def receives_a_command_before_identify(bench):
    bench.keep_sending(hold(host_timeout_ms=5000)).run(0.3).identify().run(0.1)


@pytest.mark.parametrize(
    "scenario",
    [
        leaks,
        leaks_in_contact,
        bursts,
        is_released,
        comes_down,
        vents_while_pressed,
        checks_its_tube,
        receives_a_command_before_identify,
    ],
)
def test_both_boards_send_the_same_bytes_in_each_scenario(exact_time, scenario):
    scenario(Bench(Both()))


@pytest.mark.parametrize("setpoint_pa", [2000, 4950, 8000, 12000])
def test_both_boards_send_the_same_bytes_during_contacts(exact_time, setpoint_pa):
    bench = Bench(Both()).holding(setpoint_pa)
    for contact_kpa in (3.0, 0.0):
        bench.contact_kpa = contact_kpa
        bench.run(1)
