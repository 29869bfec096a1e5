"""Relay 3: what a PLC's input sees of the board. The board in Python has none."""

import pytest

from sim.avr.board import AvrBoard
from tests.firmware.compiled import CBoard
from tests.sim.conftest import AVR_MARKS, Bench, brief, hold, vent
from tests.tools import needs


@pytest.fixture(params=[pytest.param(CBoard, marks=needs("gcc")), pytest.param(AvrBoard, marks=AVR_MARKS)])
def bench(request):
    return Bench(request.param())


@brief
def test_the_contact_is_closed_while_a_host_is_heard(bench):
    bench.run(0.5)
    assert not bench.board.ok
    bench.greet().tell(vent()).run(0.5)
    assert bench.board.ok
    bench.wanted = None
    bench.run(0.35)
    assert not bench.board.ok
    bench.tell(hold()).run(0.1)
    assert bench.board.ok


def test_a_silence_longer_than_16_bits_of_milliseconds_is_still_one(bench):
    bench.greet().tell(vent()).run(0.5)
    bench.wanted = None
    bench.run(65)
    for _ in range(500):
        bench.step()
        assert not bench.board.ok


@brief
def test_the_contact_is_open_while_a_fault_is_latched(bench):
    bench.greet().tell(vent()).run(0.5)
    bench.supply_mv = 4000
    bench.run(0.1)
    bench.supply_mv = 5000
    bench.run(0.1)
    assert not bench.board.ok
    bench.tell(vent(clear=1)).run(0.1)
    assert bench.board.ok
