"""What blocks for long is waited for beside the loop, and by nobody at the end."""

import asyncio
import threading

import pytest

from instrument.aside import aside, unless
from instrument.cli.can_face import CanFace
from instrument.config import Configuration
from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.host import Host
from instrument.settings import Settings

PATIENCE_S = 20.0


class Blocking:
    """A call that returns only when it is let, as connecting to a host that does not answer."""

    def __init__(self):
        self.begun, self._let = threading.Event(), threading.Event()
        self.ended = False

    def __call__(self, *_):
        self.begun.set()
        self._let.wait(PATIENCE_S)
        self.ended = True
        raise OSError("let go")

    def let_go(self):
        self._let.set()


@pytest.fixture
def blocking():
    call = Blocking()
    yield call
    call.let_go()


async def stopping_while(working, blocking):
    """Run `working(stop)`, and stop it once the call blocks; its own answer."""
    stop = asyncio.Event()
    task = asyncio.ensure_future(working(stop))
    while not blocking.begun.is_set():
        assert not task.done(), "it never called what blocks"
        await asyncio.sleep(0.01)
    stop.set()
    return await task


def test_what_a_call_returns_or_raises_comes_back_and_the_loop_goes_on_meanwhile(blocking):
    async def play():
        waiting = asyncio.ensure_future(aside(blocking))
        await asyncio.sleep(0.01)
        assert not waiting.done()
        blocking.let_go()
        with pytest.raises(OSError, match="let go"):
            await waiting
        return await unless(asyncio.Event(), aside(lambda: 5))

    assert asyncio.run(play()) == 5


def test_the_end_does_not_wait_for_the_first_opening_of_the_rigs_port(blocking):
    host = Host(Coupling(Instrument(Settings())), "rig", blocking)
    asyncio.run(stopping_while(host.connect, blocking))
    assert not blocking.ended


def test_the_end_does_not_wait_for_the_rigs_port_that_is_opened_anew(blocking):
    host = Host(Coupling(Instrument(Settings())), "rig", blocking)
    asyncio.run(stopping_while(host.run, blocking))
    assert not blocking.ended


def test_the_end_does_not_wait_for_a_can_bus_that_is_being_opened(blocking, monkeypatch):
    own = Configuration.model_validate({"can": {"enabled": True, "interface": "virtual"}}).can

    async def joining(stop):
        instrument = Instrument(Settings())
        face = CanFace(instrument, own)
        monkeypatch.setattr(face.bus, "open", blocking)
        await face.open(stop)
        face.close()

    asyncio.run(stopping_while(joining, blocking))
    assert not blocking.ended
