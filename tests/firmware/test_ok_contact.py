"""Tests of relay 3, the output contact "instrument OK". The Python board has no such contact."""

import pytest

from pneuforce.sim.avr.board import AvrBoard
from tests.firmware.compiled import CBoard
from tests.sim.conftest import AVR_MARKS, Bench, brief, hold, vent
from tests.tools import needs


@pytest.fixture(params=[pytest.param(CBoard, marks=needs("gcc")), pytest.param(AvrBoard, marks=AVR_MARKS)])
def bench(request):
    return Bench(request.param())


@brief
def test_the_contact_is_closed_while_the_host_is_active(bench):
    bench.run(0.5)
    assert not bench.board.ok
    bench.identify().keep_sending(vent()).run(0.5)
    assert bench.board.ok
    bench.command = None
    bench.run(0.35)
    assert not bench.board.ok
    bench.keep_sending(hold()).run(0.1)
    assert bench.board.ok


def test_the_contact_stays_open_after_65_s_without_a_command(bench):
    """A 16-bit counter of milliseconds overflows after 65.5 s."""
    bench.identify().keep_sending(vent()).run(0.5)
    bench.command = None
    bench.run(65)
    for _ in range(500):
        bench.step()
        assert not bench.board.ok


@brief
def test_the_contact_is_open_while_a_fault_is_latched(bench):
    bench.identify().keep_sending(vent()).run(0.5)
    bench.supply_mv = 4000
    bench.run(0.1)
    bench.supply_mv = 5000
    bench.run(0.1)
    assert not bench.board.ok
    bench.keep_sending(vent(clear=1)).run(0.1)
    assert bench.board.ok
