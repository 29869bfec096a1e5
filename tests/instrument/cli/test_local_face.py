"""The local face and its guests: one that does not read, a crowd, a recorder that fails, one that leaves."""

import asyncio
import signal
import socket
import sys
from asyncio.subprocess import DEVNULL
from contextlib import asynccontextmanager, suppress

import pytest

from instrument.cli.local_face import HEALTH_S, MOST_GUESTS, LocalFace
from instrument.config import Configuration
from instrument.coupling import Coupling
from instrument.errors import ConfigurationError
from instrument.events.witness import Nowhere, Witness
from instrument.tape.entry import Decoder, Entry, Kind, encode, told
from instrument.tape.feed import MOST_BACKLOG, Feed
from tests.instrument.driving import Drive
from tests.instrument.tape.taping import found

SOON_S = 10.0


@asynccontextmanager
async def facing(folder):
    """A face at a socket in the folder, and the drive of its instrument."""
    feed, drive = Feed(), Drive.zeroed()
    coupling = Coupling(drive.instrument, feed)
    face = LocalFace(coupling, Witness(coupling, Nowhere()), feed, Configuration(), lambda now_s: {})
    await face.open(folder / "s")
    try:
        yield face, drive
    finally:
        await face.close("")


class Guest:
    """A client of the socket."""

    def __init__(self, reader, writer):
        self._reader, self._writer, self._decoder = reader, writer, Decoder()

    @classmethod
    async def come(cls, folder, wants=None):
        guest = cls(*await asyncio.open_unix_connection(str(folder / "s")))
        if wants:
            guest.say(told(Kind.WANT, 0.0, {"want": wants}))
        return guest

    def say(self, entry):
        self._writer.write(encode(entry))

    async def hear(self, kind):
        """The next entry of a kind."""
        async with asyncio.timeout(SOON_S):
            while True:
                data = await self._reader.read(65536)
                assert data, "the connection has ended"
                for entry in self._decoder.feed(data):
                    if entry.kind is kind:
                        return entry

    async def turned_away(self):
        async with asyncio.timeout(SOON_S):
            with suppress(ConnectionError):
                assert await self._reader.read() == b""

    def leave(self):
        self._writer.close()


async def until(so):
    async with asyncio.timeout(SOON_S):
        while not so():
            await asyncio.sleep(0.001)


def is_begun(file):
    try:
        return bool(found(file).about)
    except ConfigurationError:
        return False


@pytest.mark.parametrize(("wants", "maintenance"), [("record", True), ("page", False)])
def test_a_guest_that_is_too_far_behind_is_let_go_and_a_recorder_missed(tmp_path, wants, maintenance):
    async def tried():
        async with facing(tmp_path) as (face, drive):
            with socket.socket(socket.AF_UNIX) as deaf:
                deaf.connect(str(tmp_path / "s"))
                deaf.sendall(encode(told(Kind.WANT, 0.0, {"want": wants})))
                await until(lambda: face.feed.listeners)
                for _ in range(2 * MOST_BACKLOG // 100_000):
                    face.feed.note(Kind.EVENT, drive.now_s, bytes(100_000))
                    face.tick(drive.now_s)
                    await asyncio.sleep(0)
                assert not face.guests
                assert not face.feed.listeners
                assert drive.instrument.recording_down == maintenance
                assert ("maintenance" in drive.see().status) == maintenance

    asyncio.run(tried())


def test_a_recorder_that_is_let_go_leaves_an_ending_that_says_so(tmp_path):
    record = ("-P", "-m", "instrument", "record", str(tmp_path / "a.tape"), "--socket", str(tmp_path / "s"))
    event = {"at": "", "kind": "test", "much": "x" * 100_000}

    async def tried():
        async with facing(tmp_path) as (face, drive):
            recorder = await asyncio.create_subprocess_exec(sys.executable, *record, stderr=DEVNULL)
            await until(lambda: face.recording)
            face.tick(drive.now_s)
            await until(lambda: is_begun(tmp_path / "a.tape"))
            recorder.send_signal(signal.SIGSTOP)
            for _ in range(2 * MOST_BACKLOG // 100_000):
                face.feed.tell(Kind.EVENT, drive.now_s, event)
                face.tick(drive.now_s)
                await asyncio.sleep(0)
            assert not face.recording
            recorder.send_signal(signal.SIGCONT)
            assert await recorder.wait() == 1

    asyncio.run(tried())
    why = "the instrument goes on, and let go of this recorder, which was too far behind"
    assert found(tmp_path / "a.tape").ending.why == why


def test_a_crowd_leaves_no_room_for_more_and_room_again_when_one_has_gone(tmp_path):
    async def tried():
        async with facing(tmp_path) as (face, _):
            crowd = [await Guest.come(tmp_path) for _ in range(MOST_GUESTS)]
            await until(lambda: len(face.guests) == MOST_GUESTS)
            await (await Guest.come(tmp_path, "page")).turned_away()
            assert len(face.guests) == MOST_GUESTS
            crowd[0].leave()
            await until(lambda: len(face.guests) < MOST_GUESTS)
            page = await Guest.come(tmp_path, "page")
            await until(lambda: face.feed.listeners)
            face.tick(0.0)
            assert (await page.hear(Kind.BEGIN)).facts
            for guest in (*crowd[1:], page):
                guest.leave()

    asyncio.run(tried())


@pytest.mark.parametrize("wants", ["record", "page"])
def test_nothing_is_kept_for_a_guest_that_has_left(tmp_path, wants):
    async def tried():
        async with facing(tmp_path) as (face, _):
            guest = await Guest.come(tmp_path, wants)
            await until(lambda: face.feed.listeners)
            guest.leave()
            await until(lambda: not face.guests)
            assert face.feed.listeners == []

    asyncio.run(tried())


def test_the_page_hears_why_a_recording_stopped_until_the_next_begins(tmp_path):
    async def tried():
        async with facing(tmp_path) as (face, _):
            page, recorder = [await Guest.come(tmp_path, wants) for wants in ("page", "record")]
            await until(lambda: len(face.feed.listeners) == 2)

            async def hears(now_s):
                face.tick(now_s)
                return (await page.hear(Kind.HEALTH)).facts["recording"]

            assert await hears(HEALTH_S) == {"on": True, "trouble": ""}
            recorder.say(Entry(Kind.TROUBLE, 0.0, b"the disk is full"))
            recorder.leave()
            await until(lambda: not face.recording)
            assert await hears(2 * HEALTH_S) == {"on": False, "trouble": "the disk is full"}
            again = await Guest.come(tmp_path, "record")
            await until(lambda: face.recording)
            assert await hears(3 * HEALTH_S) == {"on": True, "trouble": ""}
            again.leave()
            page.leave()

    asyncio.run(tried())
