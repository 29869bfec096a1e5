"""A live bus whose server or controller fails: frames are dropped, and it comes back by itself."""

import contextlib
import signal
import socket
import threading
import time
from itertools import pairwise

import pytest

from registers.can.bus import BusAt, BusFull
from registers.can.outbox import MOST_FRAMES
from tests.registers.can.buses import heard, message, numbered, opened, peer_on
from tests.registers.can.conftest import hub_process, wait_for

pytestmark = pytest.mark.usefixtures("frames_stay_fresh")


def test_the_bus_comes_back_by_itself_and_its_first_frame_is_fresh():
    got = []
    with contextlib.ExitStack() as first, contextlib.ExitStack() as second:
        port, _ = first.enter_context(hub_process())
        at = BusAt(interface="socketcand", port=port)
        with opened(at, got.append) as bus:
            first.close()
            wait_for(lambda: not bus.is_up)
            for number in range(10):
                bus.send(numbered(number))
            assert bus.dropped == 10
            second.enter_context(hub_process(port))
            with peer_on(at) as peer:
                wait_for(lambda: bus.is_up)
                bus.send(numbered(99))
                assert [int.from_bytes(m.data, "little") for m in heard(peer, 1)] == [99]
                peer.send(message(5))
                wait_for(lambda: len(got) == 1)
        assert bus.counters.reopened == 1


def test_reports_of_the_controller_are_counted_and_handed_to_nobody():
    at, got = BusAt(interface="virtual", channel="reports"), []
    with opened(at, got.append) as bus, peer_on(at) as peer:
        for error_class in (0x001, 0x004, 0x080, 0x100):  # time-out, controller, bus error, restarted
            peer.send(message(0, arbitration_id=error_class, is_error_frame=True))
        peer.send(message(7))
        wait_for(lambda: got)
        assert (bus.counters.error_frames, bus.counters.received, bus.is_up) == (4, 1, True)
    assert got == [numbered(7, 0x205)]


class _Controller:
    """A bus that answers each send as told: what only a controller in hardware would do by itself."""

    def __init__(self, outcome, dead=False):
        self.outcome, self.dead = outcome, dead
        self.closed, self.failure = threading.Event(), None

    def send(self, frame):
        if self.outcome is not None:
            raise self.outcome

    def receive(self):
        time.sleep(0.001)
        if self.dead:
            raise OSError("network is down")

    def close(self):
        self.closed.set()


@pytest.mark.parametrize(
    ("outcome", "stays_up"), [(BusFull("buffer full"), True), (OSError("network is down"), False)]
)
def test_a_full_controller_costs_the_frame_and_a_dead_one_is_opened_anew(monkeypatch, outcome, stays_up):
    controllers = [_Controller(outcome), _Controller(None)]
    opened_ones = iter(controllers)
    monkeypatch.setattr("registers.can.live.Bus", lambda at: next(opened_ones))
    with opened(BusAt()) as bus:
        bus.send(numbered(1))
        wait_for(lambda: bus.dropped == 1)
        if stays_up:
            assert bus.is_up
        else:
            wait_for(lambda: controllers[0].closed.is_set() and bus.is_up)
        assert bus.counters.reopened == (not stays_up)


def refusing(attempts_s):
    """An interface that is gone after its first failure."""

    def attempt(at):
        attempts_s.append(time.monotonic())
        if len(attempts_s) == 1:
            return _Controller(OSError("network is down"))
        raise OSError("no such device")

    return attempt


def dying(attempts_s):
    """A controller that opens well each time and is bus-off at once."""

    def attempt(at):
        attempts_s.append(time.monotonic())
        return _Controller(OSError("network is down"), dead=len(attempts_s) > 1)

    return attempt


@pytest.mark.parametrize("interface", [refusing, dying])
def test_the_waits_between_attempts_grow(monkeypatch, interface, caplog):
    attempts_s = []
    monkeypatch.setattr("registers.can.live.Bus", interface(attempts_s))
    with opened(BusAt()) as bus:
        bus.send(numbered(1))
        wait_for(lambda: len(attempts_s) == 5)
    waits_s = [b - a for a, b in pairwise(attempts_s)]
    assert all(wait_s >= least_s for wait_s, least_s in zip(waits_s, (0.09, 0.19, 0.39, 0.79), strict=True))
    assert len(caplog.records) <= 6


def test_a_controller_that_takes_nothing_for_a_second_is_called_down_until_it_takes_a_frame(
    monkeypatch, caplog
):
    controller = _Controller(BusFull("buffer full"))
    monkeypatch.setattr("registers.can.live.Bus", lambda at: controller)
    with opened(BusAt()) as bus:
        bus.send(numbered(1))
        wait_for(lambda: bus.dropped == 1)
        assert bus.is_up
        wait_for(lambda: bus.send(numbered(2)) or not bus.is_up)
        controller.outcome = None
        wait_for(lambda: bus.send(numbered(3)) or bus.is_up)
        assert bus.counters.reopened == 0
    said = [record.getMessage() for record in caplog.records]
    assert [line.split(":")[0] for line in said] == ["CAN is down", "CAN is up again"]
    assert "nobody there acknowledges" in said[0]


def test_a_controller_that_stands_costs_the_oldest_frames_and_never_the_senders_time(monkeypatch):
    controller, go_on, sent = _Controller(None), threading.Event(), []
    controller.send = lambda frame: go_on.wait(30) and sent.append(frame)
    monkeypatch.setattr("registers.can.live.Bus", lambda at: controller)
    with opened(BusAt()) as bus:
        for number in range(3 * MOST_FRAMES):
            bus.send(numbered(number))
        assert bus.counters.sent == 0
        assert bus.dropped >= 2 * MOST_FRAMES - 1
        go_on.set()
        wait_for(lambda: bus.counters.sent + bus.dropped == 3 * MOST_FRAMES)
    assert sent[-MOST_FRAMES:] == [numbered(number) for number in range(2 * MOST_FRAMES, 3 * MOST_FRAMES)]


def shakes_hands(link):
    """Whether the client wanted to; a probe only looks whether somebody answers."""
    with contextlib.suppress(ConnectionError):
        link.sendall(b"< hi >")
        for _ in range(2):
            if not link.recv(64):
                return False
            link.sendall(b"< ok >")
        return True
    return False


@contextlib.contextmanager
def server_that_reads_no_frame():
    """A socketcand server that shakes hands and then stands, with little room in its kernel."""
    with socket.create_server(("127.0.0.1", 0)) as listener, contextlib.ExitStack() as stack:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        links = []

        def serve():
            with contextlib.suppress(OSError):
                while True:
                    link = stack.enter_context(listener.accept()[0])
                    if shakes_hands(link):
                        links.append(link)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        try:
            yield listener.getsockname()[1], links
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            thread.join(5)


def test_a_server_that_stands_is_noticed_and_costs_frames_not_time(caplog):
    with server_that_reads_no_frame() as (port, _links):
        with opened(BusAt(interface="socketcand", port=port)) as bus:
            wait_for(lambda: bus.send(numbered(1)) or bus.counters.reopened)
            assert bus.dropped > 0
            assert bus.counters.sent < 1000
        assert "CAN is down: socketcand can0" in caplog.text
        assert "the server does not read" in caplog.text


def test_a_hub_that_stands_is_noticed_soon_and_nothing_of_that_time_arrives():
    with hub_process() as (port, hub):
        at, arrived = BusAt(interface="socketcand", port=port), []

        def send(number, *, until):
            def done():
                bus.send(numbered(number))
                arrived.extend(m.data[0] for m in heard(peer, 1, 0.01))
                return until()

            wait_for(done)

        with opened(at) as bus, peer_on(at) as peer:
            until_s = time.monotonic() + 0.5  # it answers echoes
            send(1, until=lambda: time.monotonic() > until_s)
            hub.send_signal(signal.SIGSTOP)
            begun_s = time.monotonic()
            send(2, until=lambda: time.monotonic() > begun_s + 0.05)
            send(3, until=lambda: not bus.is_up)
            noticed_s = time.monotonic() - begun_s
            hub.send_signal(signal.SIGCONT)
            wait_for(lambda: bus.is_up)
            send(4, until=lambda: 4 in arrived)
    assert 3 not in arrived
    assert noticed_s < 3  # 0.45 s on a machine that is not busy


def test_garbage_of_a_server_costs_the_bus_nothing():
    got = []
    with (
        server_that_reads_no_frame() as (port, links),
        opened(BusAt(interface="socketcand", port=port), got.append) as bus,
    ):
        wait_for(lambda: len(links) == 1)
        links[0].sendall(b"\xff\xfe ><< frame >< frame xyz 1.0 00 >< error unknown command >< hello 1 2 >")
        links[0].sendall(b"< frame 205 1.000000 0700000000000000 >")
        wait_for(lambda: got)
        assert (bus.is_up, bus.counters.reopened) == (True, 0)
    assert got == [numbered(7, 0x205)]


def test_the_line_that_says_down_is_one_line(monkeypatch, caplog):
    controllers = iter(
        [_Controller(OSError("network is down\nTraceback (most recent call last)")), _Controller(None)]
    )
    monkeypatch.setattr("registers.can.live.Bus", lambda at: next(controllers))
    with opened(BusAt()) as bus:
        bus.send(numbered(1))
        wait_for(lambda: bus.counters.reopened)
    (line,) = (r.getMessage() for r in caplog.records if "CAN is down" in r.getMessage())
    assert line.endswith("network is down")
