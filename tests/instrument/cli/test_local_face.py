"""The local face beside a guest that does not read."""

import asyncio
import socket

import pytest

from instrument.cli.local_face import LocalFace
from instrument.config import Configuration
from instrument.coupling import Coupling
from instrument.events.witness import Nowhere, Witness
from instrument.tape.entry import Kind, encode, told
from instrument.tape.feed import MOST_BACKLOG, Feed
from tests.instrument.driving import Drive


@pytest.mark.parametrize(("wants", "maintenance"), [("record", True), ("page", False)])
def test_a_guest_that_is_too_far_behind_is_let_go_and_a_recorder_missed(tmp_path, wants, maintenance):
    async def tried():
        feed, drive = Feed(), Drive.zeroed()
        coupling = Coupling(drive.instrument, feed)
        face = LocalFace(coupling, Witness(coupling, Nowhere()), feed, Configuration(), lambda now_s: {})
        await face.open(tmp_path / "s")
        with socket.socket(socket.AF_UNIX) as deaf:
            deaf.connect(str(tmp_path / "s"))
            deaf.sendall(encode(told(Kind.WANT, 0.0, {"want": wants})))
            while not feed.listeners:
                await asyncio.sleep(0.001)
            for _ in range(2 * MOST_BACKLOG // 100_000):
                feed.note(Kind.EVENT, drive.now_s, bytes(100_000))
                face.tick(drive.now_s)
                await asyncio.sleep(0)
            assert not face.guests
            assert not feed.listeners
            assert drive.instrument.recording_down == maintenance
            assert ("maintenance" in drive.see().status) == maintenance
        await face.close("")

    asyncio.run(tried())
