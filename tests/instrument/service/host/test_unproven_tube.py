"""Tests of the file that remembers a blocked tube over a restart."""

import asyncio
import re

import pytest

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.service.host.unproven_tube import UnprovenTube, unproven_tube_file
from pneuforce.protocol.frames import Fault
from tests.source_tree import ROOT

PORT = "/dev/pneuforce"


@pytest.fixture
def file(tmp_path):
    return unproven_tube_file(tmp_path / "events.sqlite")


@pytest.mark.parametrize(("port", "is_remembered"), [(PORT, True), ("/dev/other", False)])
def test_another_event_log_in_the_folder_does_not_forget_the_blocked_tube_of_the_rig(
    file, port, is_remembered
):
    async def life():
        instrument = Instrument(Settings())
        channel = UnprovenTube(instrument, file, PORT)
        instrument.trip(Fault.OCCLUSION)
        await ticks(channel, lambda: file.exists() and file.read_text())

        restarted = Instrument(Settings())
        channel = UnprovenTube(restarted, file.with_name("tube-unproven-other.sqlite"), port)
        assert restarted.proof_tests.tube_unproven is is_remembered
        restarted.proof_tests.tube_unproven = False
        for tick in range(20):
            channel.tick(0.01 * tick)
            await asyncio.sleep(0.01)
        assert file.exists() is not is_remembered

    asyncio.run(asyncio.wait_for(life(), 20.0))


def test_the_documented_restore_of_a_log_does_not_move_the_file(file):
    document = (ROOT / "docs/how-to/maintenance.md").read_text(encoding="utf-8")
    pattern = re.search(r"mv /var/lib/pneuforce/(\S+) replaced/", document)[1]
    file.touch()
    file.with_name("events.sqlite").touch()
    assert [moved.name for moved in file.parent.glob(pattern)] == ["events.sqlite"]


async def ticks(channel, until, now_s=0.0):
    """Call the channel each 10 ms until a condition is true."""
    while not until():
        channel.tick(now_s := now_s + 0.01)
        await asyncio.sleep(0.01)


def test_a_restart_remembers_a_blocked_tube_until_a_proof_test_has_passed(file):
    async def life():
        instrument = Instrument(Settings())
        channel = UnprovenTube(instrument, file, PORT)
        channel.tick(0.0)
        assert not instrument.proof_tests.tube_unproven
        instrument.trip(Fault.OCCLUSION)
        await ticks(channel, file.exists)

        restarted = Instrument(Settings())
        channel = UnprovenTube(restarted, file, PORT)
        assert restarted.proof_tests.tube_unproven
        restarted.proof_tests.tube_unproven = False
        await ticks(channel, lambda: not file.exists())
        assert not file.exists()

    asyncio.run(asyncio.wait_for(life(), 20.0))
    instrument = Instrument(Settings())
    UnprovenTube(instrument, file, PORT)
    assert not instrument.proof_tests.tube_unproven


def test_a_file_that_cannot_be_written_is_logged_and_written_later(file, caplog):
    async def life():
        hidden = unproven_tube_file(file.parent / "absent" / "events.sqlite")
        instrument = Instrument(Settings())
        channel = UnprovenTube(instrument, hidden, PORT)
        instrument.trip(Fault.OCCLUSION)
        await ticks(channel, lambda: "forget the blocked tube" in caplog.text)
        assert "check the disk" in caplog.text
        hidden.parent.mkdir()
        await ticks(channel, hidden.exists)

    asyncio.run(asyncio.wait_for(life(), 20.0))
