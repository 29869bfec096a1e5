"""Tests of the notifications to systemd, with a real socket and with the loop in virtual time."""

import asyncio
import os
import time
from threading import Event, Thread

import pytest

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.service.host.host import Host
from pneuforce.instrument.service.systemd_notify import (
    SystemdNotifier,
    notify_to,
    systemd_notifier,
    watchdog_s_of,
)
from tests.instrument.fake_board import FakeCable
from tests.instrument.instrument_harness import HOLD_8, VENT, InstrumentHarness
from tests.notified import Manager

WATCHDOG_S = 2.0
MINE = {"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": str(os.getpid())}


@pytest.fixture(params=["path", "abstract"])
def manager(request, tmp_path):
    names = {"path": f"{tmp_path}/notify", "abstract": f"@pneuforce-test-{os.getpid()}"}
    manager = Manager(names[request.param])
    yield manager
    manager.socket.close()


def notifier_of(harness, manager):
    return systemd_notifier(harness.instrument, {**MINE, "NOTIFY_SOCKET": manager.address})


def messages_during(notifier, harness, seconds, manager):
    """Run the loop for a time. Return all messages of this time.

    Messages are read after each step, because some kernels queue only ten datagrams.
    """
    lines = manager.heard()
    for _ in range(round(seconds * 100)):
        harness.run(0.01)
        notifier.tick(harness.now_s)
        lines += manager.heard()
    return lines


def test_nothing_is_sent_before_the_instrument_serves(manager):
    harness = InstrumentHarness.new()
    notifier = notifier_of(harness, manager)
    assert messages_during(notifier, harness, 1.0, manager) == []
    notifier.ready()
    assert manager.heard() == ["READY=1"]


def test_the_watchdog_message_is_sent_four_times_per_watchdog_time(manager):
    harness = InstrumentHarness.new()
    notifier = notifier_of(harness, manager)
    notifier.ready()
    heard = messages_during(notifier, harness, 10.0, manager)
    assert heard.count("WATCHDOG=1") == pytest.approx(10.0 / (WATCHDOG_S / 4), abs=1)


def watchdog_times_s(manager, until):
    """Return the arrival times of the watchdog messages until `until` is set."""
    times_s = []
    while not until.wait(0.01):
        times_s += [time.monotonic()] * manager.heard().count("WATCHDOG=1")
    return times_s


BLOCKED_S = 1.0


async def run_and_block(host):
    """Run a host and block its loop once. Return the time [s] at which the block began."""
    stop = asyncio.Event()
    await host.connect(stop)
    working = asyncio.create_task(host.run(stop))
    await asyncio.sleep(0.3)
    began_s = time.monotonic()
    time.sleep(BLOCKED_S)
    await asyncio.sleep(0.3)
    stop.set()
    await working
    return began_s


def test_a_blocked_loop_sends_nothing_although_threads_continue(manager, tmp_path):
    cable = FakeCable(tmp_path / "rig")
    board = cable.plug()
    host = Host(Session(Instrument(Settings())), str(cable.path))
    notifier = SystemdNotifier(host.instrument, notify_to(manager.address), watchdog_s=0.4)
    host.channels.append(notifier)
    notifier.ready()
    ended, heard_s = Event(), []
    listener = Thread(target=lambda: heard_s.extend(watchdog_times_s(manager, ended)))
    listener.start()
    began_s = asyncio.run(run_and_block(host))
    ended.set()
    listener.join()
    board.end()
    stuck = [t_s for t_s in heard_s if began_s + 0.1 < t_s < began_s + BLOCKED_S - 0.1]
    assert stuck == []
    assert min(heard_s) < began_s < max(heard_s)


def test_the_state_is_sent_when_it_changes(manager):
    harness = InstrumentHarness.zeroed()
    notifier = notifier_of(harness, manager)
    notifier.ready()
    heard = messages_during(notifier, harness, 1.0, manager)
    harness.write_ok(VENT)
    harness.write_ok(HOLD_8)
    heard += messages_during(notifier, harness, 6.0, manager)
    states = [line for line in heard if line.startswith("STATUS=")]
    assert states[0] == "STATUS=vented"
    assert states[-1] == "STATUS=holding"
    assert len(states) == len(set(states))


def test_a_fault_is_sent_with_its_name(manager):
    harness = InstrumentHarness.new()
    notifier = notifier_of(harness, manager)
    notifier.ready()
    harness.run(1.0)
    harness.run_without_samples(1.0)
    notifier.tick(harness.now_s)
    assert manager.heard()[-1].endswith(": link lost")


def test_after_stopping_no_watchdog_message_is_sent(manager):
    harness = InstrumentHarness.new()
    notifier = notifier_of(harness, manager)
    notifier.ready()
    notifier.stopping()
    assert messages_during(notifier, harness, 1.0, manager) == [
        "READY=1",
        "STOPPING=1",
        "STATUS=venting, then ending",
    ]


def test_a_manager_that_does_not_read_delays_nothing(manager):
    notifier = SystemdNotifier(InstrumentHarness.new().instrument, notify_to(manager.address), WATCHDOG_S)
    for _ in range(5000):  # more datagrams than any queue holds
        notifier.ready()
    assert set(manager.heard()) == {"READY=1"}


def test_a_message_that_was_not_accepted_is_sent_again(manager):
    notify = notify_to(manager.address)
    while notify("FILLED=1"):
        pass
    harness = InstrumentHarness.new()
    notifier = notifier_of(harness, manager)
    notifier.ready()
    assert set(manager.heard()) == {"FILLED=1"}
    assert messages_during(notifier, harness, 1.0, manager)[:3] == ["READY=1", "WATCHDOG=1", "STATUS=vented"]


@pytest.mark.parametrize("address", ["", "relative", "/nowhere/at/all"])
def test_without_a_manager_nothing_is_sent(address):
    notifier = systemd_notifier(InstrumentHarness.new().instrument, {**MINE, "NOTIFY_SOCKET": address})
    notifier.ready()
    notifier.tick(0.0)
    notifier.stopping()


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
def test_a_watchdog_for_another_process_is_ignored(environment, manager):
    assert watchdog_s_of(environment) == float("inf")
    harness = InstrumentHarness.new()
    notifier = systemd_notifier(harness.instrument, {**environment, "NOTIFY_SOCKET": manager.address})
    notifier.ready()
    assert "WATCHDOG=1" not in messages_during(notifier, harness, 2.0, manager)


def test_the_watchdog_time_is_read_in_seconds():
    assert watchdog_s_of(MINE) == WATCHDOG_S
