"""What a service manager hears of the instrument, on a real socket; the loop in virtual time."""

import asyncio
import os
import time
from threading import Event, Thread

import pytest

from instrument.cli.notify import ServiceFace, service_face, tell_to, watch_s_of
from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.host import Host
from instrument.settings import Settings
from tests.instrument.driving import HOLD_8, VENT, Drive
from tests.instrument.plugged import Cable
from tests.notified import Manager

WATCH_S = 2.0
MINE = {"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": str(os.getpid())}


@pytest.fixture(params=["path", "abstract"])
def manager(request, tmp_path):
    names = {"path": f"{tmp_path}/notify", "abstract": f"@pneuforce-test-{os.getpid()}"}
    heard_by = Manager(names[request.param])
    yield heard_by
    heard_by.socket.close()


def face_of(drive, manager):
    return service_face(drive.instrument, {**MINE, "NOTIFY_SOCKET": manager.address})


def beats(face, drive, seconds, manager):
    """What is heard while the loop goes round: some kernels keep only ten datagrams."""
    lines = manager.heard()
    for _ in range(round(seconds * 100)):
        drive.run(0.01)
        face.tick(drive.now_s)
        lines += manager.heard()
    return lines


def test_the_manager_hears_of_no_beat_before_the_instrument_serves(manager):
    drive = Drive.new()
    face = face_of(drive, manager)
    assert beats(face, drive, 1.0, manager) == []
    face.ready()
    assert manager.heard() == ["READY=1"]


def test_the_watchdog_hears_each_quarter_of_its_patience_and_no_oftener(manager):
    drive = Drive.new()
    face = face_of(drive, manager)
    face.ready()
    heard = beats(face, drive, 10.0, manager)
    assert heard.count("WATCHDOG=1") == pytest.approx(10.0 / (WATCH_S / 4), abs=1)


def beats_heard(manager, until):
    """When each beat came, as a thread hears them until `until` is set."""
    beats_s = []
    while not until.wait(0.01):
        beats_s += [time.monotonic()] * manager.heard().count("WATCHDOG=1")
    return beats_s


STUCK_S = 1.0


async def work_and_get_stuck(host):
    """Run a host whose loop once stands still; when that began."""
    stop = asyncio.Event()
    await host.connect(stop)
    working = asyncio.create_task(host.run(stop))
    await asyncio.sleep(0.3)
    began_s = time.monotonic()
    time.sleep(STUCK_S)
    await asyncio.sleep(0.3)
    stop.set()
    await working
    return began_s


def test_the_watchdog_hears_nothing_of_a_loop_that_is_stuck_though_threads_go_on(manager, tmp_path):
    cable = Cable(tmp_path / "rig")
    board = cable.plug()
    host = Host(Coupling(Instrument(Settings())), str(cable.path))
    face = ServiceFace(host.instrument, tell_to(manager.address), watch_s=0.4)
    host.faces.append(face)
    face.ready()
    ended, heard_s = Event(), []
    listener = Thread(target=lambda: heard_s.extend(beats_heard(manager, ended)))
    listener.start()
    began_s = asyncio.run(work_and_get_stuck(host))
    ended.set()
    listener.join()
    board.end()
    stuck = [t_s for t_s in heard_s if began_s + 0.1 < t_s < began_s + STUCK_S - 0.1]
    assert stuck == []
    assert min(heard_s) < began_s < max(heard_s)


def test_the_state_is_told_in_words_when_it_changes(manager):
    drive = Drive.zeroed()
    face = face_of(drive, manager)
    face.ready()
    heard = beats(face, drive, 1.0, manager)
    drive.must(VENT)
    drive.must(HOLD_8)
    heard += beats(face, drive, 6.0, manager)
    told = [line for line in heard if line.startswith("STATUS=")]
    assert told[0] == "STATUS=vented"
    assert told[-1] == "STATUS=holding"
    assert len(told) == len(set(told))


def test_a_fault_is_told_by_name(manager):
    drive = Drive.new()
    face = face_of(drive, manager)
    face.ready()
    drive.run(1.0)
    drive.now_s += 1.0  # in silence
    drive.instrument.tick(drive.now_s)
    face.tick(drive.now_s)
    assert manager.heard()[-1] == "STATUS=no word from the board: link lost"


def test_an_instrument_that_ends_says_so_and_beats_no_more(manager):
    drive = Drive.new()
    face = face_of(drive, manager)
    face.ready()
    face.stopping()
    assert beats(face, drive, 1.0, manager) == ["READY=1", "STOPPING=1", "STATUS=venting, then ending"]


def test_a_manager_that_reads_nothing_holds_up_nobody(manager):
    face = ServiceFace(Drive.new().instrument, tell_to(manager.address), WATCH_S)
    for _ in range(5000):  # more than any queue of datagrams takes
        face.ready()
    assert set(manager.heard()) == {"READY=1"}


def test_what_a_manager_had_no_room_for_is_told_again(manager):
    tell = tell_to(manager.address)
    while tell("FILLED=1"):
        pass
    drive = Drive.new()
    face = face_of(drive, manager)
    face.ready()
    assert set(manager.heard()) == {"FILLED=1"}
    assert beats(face, drive, 1.0, manager)[:3] == ["READY=1", "WATCHDOG=1", "STATUS=vented"]


@pytest.mark.parametrize("address", ["", "relative", "/nowhere/at/all"])
def test_without_a_manager_the_instrument_works_as_ever(address):
    face = service_face(Drive.new().instrument, {**MINE, "NOTIFY_SOCKET": address})
    face.ready()
    face.tick(0.0)
    face.stopping()


@pytest.mark.parametrize(
    "environment",
    [
        {},
        {"WATCHDOG_USEC": ""},
        {"WATCHDOG_USEC": "0"},
        {"WATCHDOG_USEC": "soon"},
        {**MINE, "WATCHDOG_PID": "1"},
    ],
)
def test_a_watch_that_is_not_ours_is_not_kept(environment, manager):
    assert watch_s_of(environment) == float("inf")
    drive = Drive.new()
    face = service_face(drive.instrument, {**environment, "NOTIFY_SOCKET": manager.address})
    face.ready()
    assert "WATCHDOG=1" not in beats(face, drive, 2.0, manager)


def test_the_watch_is_read_in_seconds():
    assert watch_s_of(MINE) == WATCH_S
