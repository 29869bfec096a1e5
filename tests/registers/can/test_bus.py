"""The same cases on python-can's virtual bus and on the hub, with real threads and real sockets."""

import contextlib
import threading
import time
from itertools import count, pairwise

import can
import pytest

from registers.can.bus import BusAt, BusFull, listen
from registers.can.live import CanBus
from registers.can.wire import CanFrame, Kind
from tests.registers.can.conftest import hub_process, wait_for

_channels = count()
BURST = 2000


@pytest.fixture(params=["virtual", "socketcand"])
def at(request):
    if request.param == "virtual":
        return BusAt(interface="virtual", channel=f"test-{next(_channels)}")
    return BusAt(interface="socketcand", port=request.getfixturevalue("hub_port"))


@contextlib.contextmanager
def opened(at, on_frame=lambda frame: None, heartbeat_id=None):
    bus = CanBus(at, on_frame)
    bus.open(heartbeat_id)
    try:
        yield bus
    finally:
        bus.close()


@contextlib.contextmanager
def peer_on(at):
    """Somebody else's client: python-can itself."""
    options = {"host": at.host, "port": at.port, "tcp_tune": True} if at.interface == "socketcand" else {}
    with can.Bus(interface=at.interface, channel=at.channel, ignore_config=True, **options) as peer:
        yield peer


def numbered(number, can_id=0x185):
    return CanFrame(can_id, number.to_bytes(8, "little"))


def message(number, **more):
    fields = {"arbitration_id": 0x205, "data": number.to_bytes(8, "little"), "is_extended_id": False}
    return can.Message(**(fields | more))


def heard(peer, how_many, deadline_s=5.0):
    until_s, messages = time.monotonic() + deadline_s, []
    while len(messages) < how_many and time.monotonic() < until_s:
        received = peer.recv(0.1)
        messages += [received] if received is not None else []
    return messages


def test_frames_arrive_as_they_were_sent(at):
    with opened(at) as bus, peer_on(at) as peer:
        for frame in (CanFrame(0x185, bytes(range(8))), CanFrame(0x705, b"\x05"), CanFrame(0x085)):
            bus.send(frame)
        received = [(m.arbitration_id, bytes(m.data), m.is_extended_id) for m in heard(peer, 3)]
    assert received == [(0x185, bytes(range(8)), False), (0x705, b"\x05", False), (0x085, b"", False)]


def test_frames_of_others_arrive_and_our_own_do_not(at):
    got = []
    with opened(at, got.append) as bus, peer_on(at) as peer:
        bus.send(numbered(1))
        peer.send(message(2))
        peer.send(message(3, arbitration_id=0x12345, is_extended_id=True))
        wait_for(lambda: len(got) == 2)
        assert len(heard(peer, 1)) == 1
    assert got[0] == CanFrame(0x205, (2).to_bytes(8, "little"))
    assert (got[1].id, got[1].kind) == (0x12345, Kind.EXTENDED)


def test_a_burst_passes_both_ways_without_loss_and_in_order(at):
    got = []
    with opened(at, got.append) as bus, peer_on(at) as peer:
        for number in range(BURST):
            peer.send(message(number))
        wait_for(lambda: len(got) >= BURST)
        for number in range(BURST):
            bus.send(numbered(number))
            if number % 100 == 99:  # the outbox holds 256 and drops on purpose
                wait_for(lambda sent=number + 1: bus.counters.sent == sent)
        messages = heard(peer, BURST)
    assert [int.from_bytes(frame.data, "little") for frame in got] == list(range(BURST))
    assert [int.from_bytes(m.data, "little") for m in messages] == list(range(BURST))
    assert bus.dropped == 0


def test_a_receiver_that_fails_is_logged_and_the_next_frame_arrives(at, caplog):
    got = []

    def fragile(frame):
        got.append(frame)
        if len(got) == 1:
            raise RuntimeError("our own mistake")

    with opened(at, fragile) as bus, peer_on(at) as peer:
        peer.send(message(1))
        peer.send(message(2))
        wait_for(lambda: len(got) == 2)
        assert bus.is_up
        assert bus.counters.errors == 1
    assert "our own mistake" in caplog.text


def test_sending_does_not_wait_and_arrives_within_milliseconds(at):
    with opened(at) as bus, peer_on(at) as peer:
        bus.send(numbered(0))
        assert heard(peer, 1)
        delays_s = []
        for _ in range(200):
            begun_s = time.perf_counter()
            bus.send(numbered(1))
            assert heard(peer, 1)
            delays_s.append(time.perf_counter() - begun_s)
    delays_s.sort()
    assert delays_s[100] < 0.005  # generous: this machine may be busy; the benchmark holds the real target


def test_closing_ends_within_a_third_of_a_second_and_sends_what_waits(at):
    with peer_on(at) as peer:
        with opened(at) as bus:
            heard(peer, 1, deadline_s=0.15)
            for number in range(50):
                bus.send(numbered(number))
            begun_s = time.monotonic()
        assert time.monotonic() - begun_s < 0.3
        assert len(heard(peer, 50)) == 50
    assert not bus.is_up


def test_a_node_id_that_another_node_uses_is_refused_in_a_sentence(at):
    stop = threading.Event()

    def beat(peer):
        while not stop.wait(0.3):
            peer.send(message(0, arbitration_id=0x705, data=b"\x05"))

    with peer_on(at) as peer:
        other = threading.Thread(target=beat, args=(peer,))
        other.start()
        try:
            with pytest.raises(OSError, match=r"CAN node id 5 is taken on .*: another node sends 705h"):
                CanBus(at, print).open(0x705)
        finally:
            stop.set()
            other.join()


def test_a_free_node_id_is_taken_after_listening(at):
    begun_s = time.monotonic()
    with opened(at, heartbeat_id=0x705) as bus:
        assert bus.is_up
        assert time.monotonic() - begun_s >= 1.2


def test_a_listener_hears_everything_until_it_is_stopped(at):
    stop, frames = threading.Event(), []
    with opened(at) as bus:
        listener = threading.Thread(target=lambda: frames.extend(listen(at, stop)))
        listener.start()
        try:
            time.sleep(0.2)
            bus.send(numbered(7))
            time.sleep(0.2)
        finally:
            stop.set()
            listener.join(1.0)
        assert not listener.is_alive()
    ((t_s, frame),) = frames
    assert frame == numbered(7)
    assert abs(time.time() - t_s) < 5


@pytest.mark.parametrize(
    ("at", "sentence"),
    [
        (BusAt(interface="socketcand", port=1), "can0 at 127.0.0.1:1 cannot be opened: Connection refused"),
        (BusAt(interface="socketcan", channel="none7"), "socketcan none7 cannot be opened: "),
    ],
)
def test_an_interface_that_is_not_there_is_refused_at_once_in_a_sentence(at, sentence):
    begun_s = time.monotonic()
    with pytest.raises(OSError, match=sentence):
        CanBus(at, print).open()
    assert time.monotonic() - begun_s < 1


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


class _Controller:
    """A bus that answers each send as told: what only a controller in hardware would do by itself."""

    def __init__(self, outcome):
        self.outcome, self.closed = outcome, threading.Event()

    def send(self, frame):
        if self.outcome is not None:
            raise self.outcome

    def receive(self):
        time.sleep(0.001)

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


def test_the_waits_between_attempts_grow(monkeypatch):
    attempts_s = []

    def refuse(at):
        attempts_s.append(time.monotonic())
        if len(attempts_s) == 1:
            return _Controller(OSError("network is down"))
        raise OSError("network is down")

    monkeypatch.setattr("registers.can.live.Bus", refuse)
    with opened(BusAt()) as bus:
        bus.send(numbered(1))
        wait_for(lambda: len(attempts_s) == 4)
    waits_s = [b - a for a, b in pairwise(attempts_s)]
    assert waits_s[0] < waits_s[1] < waits_s[2]
