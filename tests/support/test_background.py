"""Tests of background calls, which do not block the loop and do not delay the end of the process."""

import asyncio
import threading

import pytest

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.service.buses.can_server import CanServer
from pneuforce.instrument.service.host.host import Host
from pneuforce.support.background import cancel_on, run_in_background

TIMEOUT_S = 20.0


class Blocking:
    """Call that blocks until it is released, like a connection to a host that does not answer."""

    def __init__(self):
        self.begun, self._released = threading.Event(), threading.Event()
        self.ended = False

    def __call__(self, *_):
        self.begun.set()
        self._released.wait(TIMEOUT_S)
        self.ended = True
        raise OSError("released")

    def release(self):
        self._released.set()


@pytest.fixture
def blocking():
    call = Blocking()
    yield call
    call.release()


async def stopping_while(working, blocking):
    """Run `working(stop)`, set `stop` when its call of `blocking` has begun, and return its result."""
    stop = asyncio.Event()
    task = asyncio.ensure_future(working(stop))
    while not blocking.begun.is_set():
        assert not task.done(), "the blocking call was not reached"
        await asyncio.sleep(0.01)
    stop.set()
    return await task


def test_a_call_returns_or_raises_while_the_loop_continues(blocking):
    async def run():
        waiting = asyncio.ensure_future(run_in_background(blocking))
        await asyncio.sleep(0.01)
        assert not waiting.done()
        blocking.release()
        with pytest.raises(OSError, match="released"):
            await waiting
        return await cancel_on(asyncio.Event(), run_in_background(lambda: 5))

    assert asyncio.run(run()) == 5


def test_the_end_does_not_wait_for_the_first_opening_of_the_port(blocking):
    host = Host(Session(Instrument(Settings())), "rig", blocking)
    asyncio.run(stopping_while(host.connect, blocking))
    assert not blocking.ended


def test_the_end_does_not_wait_for_the_port_that_is_opened_again(blocking):
    host = Host(Session(Instrument(Settings())), "rig", blocking)
    asyncio.run(stopping_while(host.run, blocking))
    assert not blocking.ended


def test_the_end_does_not_wait_for_a_can_bus_that_is_being_opened(blocking, monkeypatch):
    settings = Configuration.model_validate({"can": {"enabled": True, "interface": "virtual"}}).can

    async def joining(stop):
        instrument = Instrument(Settings())
        server = CanServer(instrument, settings)
        monkeypatch.setattr(server.bus, "open", blocking)
        await server.open(stop)
        server.close()

    asyncio.run(stopping_while(joining, blocking))
    assert not blocking.ended
