"""Tests of a connection whose server or controller fails. Frames are dropped, and the bus is reopened."""

import contextlib
import signal
import socket
import threading
import time
from itertools import pairwise

import pytest

from pneuforce.registers.can.bus import CanAddress, TxBufferFullError
from pneuforce.registers.can.transmit_queue import MAX_FRAMES, DropCause
from tests.registers.can.bus_helpers import (
    message,
    numbered_frame,
    opened_connection,
    python_can_client,
    received_messages,
)
from tests.registers.can.conftest import hub_process, wait_for

pytestmark = pytest.mark.usefixtures("no_frame_expiry")


def test_the_bus_is_reopened_and_its_first_frame_is_new():
    got = []
    with contextlib.ExitStack() as first, contextlib.ExitStack() as second:
        port, _ = first.enter_context(hub_process())
        at = CanAddress(interface="socketcand", port=port)
        with opened_connection(at, got.append) as bus:
            first.close()
            wait_for(lambda: not bus.is_up)
            for number in range(10):
                bus.send(numbered_frame(number))
            assert bus.dropped == bus.drops[DropCause.BUS_DOWN] == 10
            second.enter_context(hub_process(port))
            with python_can_client(at) as peer:
                wait_for(lambda: bus.is_up)
                bus.send(numbered_frame(99))
                assert [int.from_bytes(m.data, "little") for m in received_messages(peer, 1)] == [99]
                peer.send(message(5))
                wait_for(lambda: len(got) == 1)
        assert bus.counters.reopened == 1


def test_error_frames_are_counted_and_not_delivered():
    at, got = CanAddress(interface="virtual", channel="reports"), []
    with opened_connection(at, got.append) as bus, python_can_client(at) as peer:
        for error_class in (0x001, 0x004, 0x080, 0x100):  # TX timeout, controller problem, bus error, restart
            peer.send(message(0, arbitration_id=error_class, is_error_frame=True))
        peer.send(message(7))
        wait_for(lambda: got)
        assert (bus.counters.error_frames, bus.counters.received, bus.is_up) == (4, 1, True)
    assert got == [numbered_frame(7, 0x205)]


class _FakeBus:
    """Bus whose `send` raises `outcome`, an error that otherwise only a real controller raises."""

    def __init__(self, outcome, failed=False):
        self.outcome, self.failed = outcome, failed
        self.closed, self.failure = threading.Event(), None

    def send(self, frame):
        if self.outcome is not None:
            raise self.outcome

    def receive(self, timeout_s):
        time.sleep(min(timeout_s, 0.001))
        if self.failed:
            raise OSError("network is down")

    def close(self):
        self.closed.set()


@pytest.mark.parametrize(
    ("outcome", "cause"),
    [
        (TxBufferFullError("buffer full"), DropCause.NOT_ACCEPTED),
        (OSError("network is down"), DropCause.BUS_DOWN),
    ],
)
def test_a_full_buffer_drops_the_frame_and_a_failed_bus_is_reopened(monkeypatch, outcome, cause):
    controllers = [_FakeBus(outcome), _FakeBus(None)]
    buses = iter(controllers)
    monkeypatch.setattr("pneuforce.registers.can.connection.CanBus", lambda at: next(buses))
    with opened_connection(CanAddress()) as bus:
        bus.send(numbered_frame(1))
        wait_for(lambda: bus.drops[cause] == 1)
        stays_up = cause is DropCause.NOT_ACCEPTED
        if stays_up:
            assert bus.is_up
        else:
            wait_for(lambda: controllers[0].closed.is_set() and bus.is_up)
        assert bus.counters.reopened == (not stays_up)


def missing_interface(attempts_s):
    """Return a replacement for CanBus. The first bus fails; after that, the interface no longer exists."""

    def attempt(at):
        attempts_s.append(time.monotonic())
        if len(attempts_s) == 1:
            return _FakeBus(OSError("network is down"))
        raise OSError("no such device")

    return attempt


def failing_interface(attempts_s):
    """Return a replacement for CanBus. The bus can be opened each time, and then fails at once."""

    def attempt(at):
        attempts_s.append(time.monotonic())
        return _FakeBus(OSError("network is down"), failed=len(attempts_s) > 1)

    return attempt


@pytest.mark.parametrize("interface", [missing_interface, failing_interface])
def test_the_waits_between_attempts_grow(monkeypatch, interface, caplog):
    attempts_s = []
    monkeypatch.setattr("pneuforce.registers.can.connection.CanBus", interface(attempts_s))
    with opened_connection(CanAddress()) as bus:
        bus.send(numbered_frame(1))
        wait_for(lambda: len(attempts_s) == 5)
    waits_s = [b - a for a, b in pairwise(attempts_s)]
    assert all(wait_s >= min_s for wait_s, min_s in zip(waits_s, (0.09, 0.19, 0.39, 0.79), strict=True))
    assert len(caplog.records) <= 6


def test_a_controller_that_accepts_nothing_for_a_second_is_down_until_it_accepts_a_frame(monkeypatch, caplog):
    controller = _FakeBus(TxBufferFullError("buffer full"))
    monkeypatch.setattr("pneuforce.registers.can.connection.CanBus", lambda at: controller)
    with opened_connection(CanAddress()) as bus:
        bus.send(numbered_frame(1))
        wait_for(lambda: bus.dropped == 1)
        assert bus.is_up
        wait_for(lambda: bus.send(numbered_frame(2)) or not bus.is_up)
        controller.outcome = None
        wait_for(lambda: bus.send(numbered_frame(3)) or bus.is_up)
        assert bus.counters.reopened == 0
    lines = [record.getMessage() for record in caplog.records]
    assert [line.split(":")[0] for line in lines] == ["CAN is down", "CAN is up again"]
    assert "acknowledges" in lines[0]


def test_a_blocked_controller_drops_the_oldest_frames_and_does_not_block_the_caller(monkeypatch):
    controller, unblock, sent = _FakeBus(None), threading.Event(), []
    controller.send = lambda frame: unblock.wait(30) and sent.append(frame)
    monkeypatch.setattr("pneuforce.registers.can.connection.CanBus", lambda at: controller)
    with opened_connection(CanAddress()) as bus:
        for number in range(3 * MAX_FRAMES):
            bus.send(numbered_frame(number))
        assert bus.counters.sent == 0
        assert bus.dropped >= 2 * MAX_FRAMES - 1
        unblock.set()
        wait_for(lambda: bus.counters.sent + bus.dropped == 3 * MAX_FRAMES)
    assert sent[-MAX_FRAMES:] == [numbered_frame(number) for number in range(2 * MAX_FRAMES, 3 * MAX_FRAMES)]


def complete_handshake(link):
    """Return True if the client completes the handshake.

    The client opens its first connection only to test the port, without a handshake.
    """
    with contextlib.suppress(ConnectionError):
        link.sendall(b"< hi >")
        for _ in range(2):
            if not link.recv(64):
                return False
            link.sendall(b"< ok >")
        return True
    return False


@contextlib.contextmanager
def server_that_does_not_read():
    """Yield the port and the connections of a server that stops reading after the handshake."""
    with socket.create_server(("127.0.0.1", 0)) as listener, contextlib.ExitStack() as stack:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        links = []

        def serve():
            with contextlib.suppress(OSError):
                while True:
                    link = stack.enter_context(listener.accept()[0])
                    if complete_handshake(link):
                        links.append(link)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        try:
            yield listener.getsockname()[1], links
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            thread.join(5)


def test_a_server_that_does_not_read_is_detected_and_frames_are_dropped(caplog):
    with server_that_does_not_read() as (port, _links):
        with opened_connection(CanAddress(interface="socketcand", port=port)) as bus:
            wait_for(lambda: bus.send(numbered_frame(1)) or bus.counters.reopened)
            assert bus.dropped > 0
            assert bus.counters.sent < 1000
        assert "CAN is down: socketcand can0" in caplog.text
        assert "the server does not read" in caplog.text


def test_a_suspended_hub_is_detected_soon_and_frames_sent_meanwhile_do_not_arrive():
    with hub_process() as (port, hub):
        at, arrived = CanAddress(interface="socketcand", port=port), []

        def send(number, *, until):
            def done():
                bus.send(numbered_frame(number))
                arrived.extend(m.data[0] for m in received_messages(peer, 1, 0.01))
                return until()

            wait_for(done)

        with opened_connection(at) as bus, python_can_client(at) as peer:
            until_s = time.monotonic() + 0.5  # the hub needs time to answer echo requests
            send(1, until=lambda: time.monotonic() > until_s)
            hub.send_signal(signal.SIGSTOP)
            started_s = time.monotonic()
            send(2, until=lambda: time.monotonic() > started_s + 0.05)
            send(3, until=lambda: not bus.is_up)
            detected_s = time.monotonic() - started_s
            hub.send_signal(signal.SIGCONT)
            wait_for(lambda: bus.is_up)
            send(4, until=lambda: 4 in arrived)
    assert 3 not in arrived
    assert detected_s < 3  # takes 0.45 s on an idle machine


def test_garbage_from_a_server_does_not_disturb_the_bus():
    got = []
    with (
        server_that_does_not_read() as (port, links),
        opened_connection(CanAddress(interface="socketcand", port=port), got.append) as bus,
    ):
        wait_for(lambda: len(links) == 1)
        links[0].sendall(b"\xff\xfe ><< frame >< frame xyz 1.0 00 >< error unknown command >< hello 1 2 >")
        links[0].sendall(b"< frame 205 1.000000 0700000000000000 >")
        wait_for(lambda: got)
        assert (bus.is_up, bus.counters.reopened) == (True, 0)
    assert got == [numbered_frame(7, 0x205)]


def test_the_log_entry_about_a_failure_is_one_line(monkeypatch, caplog):
    controllers = iter(
        [_FakeBus(OSError("network is down\nTraceback (most recent call last)")), _FakeBus(None)]
    )
    monkeypatch.setattr("pneuforce.registers.can.connection.CanBus", lambda at: next(controllers))
    with opened_connection(CanAddress()) as bus:
        bus.send(numbered_frame(1))
        wait_for(lambda: bus.counters.reopened)
    (line,) = (r.getMessage() for r in caplog.records if "CAN is down" in r.getMessage())
    assert "network is down" in line
    assert "Traceback" not in line
