"""The same cases on python-can's virtual bus and on the hub, with real threads and real sockets."""

import threading
import time
from itertools import count

import pytest

from registers.can.bus import BusAt, listen
from registers.can.live import CanBus
from registers.can.wire import CanFrame, Kind
from tests.registers.can.buses import heard, message, numbered, opened, peer_on
from tests.registers.can.conftest import wait_for

pytestmark = pytest.mark.usefixtures("frames_stay_fresh")
_channels = count()
BURST = 2000


@pytest.fixture(params=["virtual", "socketcand"])
def at(request):
    if request.param == "virtual":
        return BusAt(interface="virtual", channel=f"test-{next(_channels)}")
    return BusAt(interface="socketcand", port=request.getfixturevalue("hub_port"))


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


def test_a_frame_is_not_kept_for_the_next_one(at):
    """The quickest of many tells: it is quick on a busy machine too."""
    with opened(at) as bus, peer_on(at) as peer:
        bus.send(numbered(0))
        assert heard(peer, 1)
        delays_s = []
        for _ in range(200):
            begun_s = time.perf_counter()
            bus.send(numbered(1))
            assert heard(peer, 1)
            delays_s.append(time.perf_counter() - begun_s)
    assert min(delays_s) < 0.005


def test_closing_ends_soon_and_sends_what_waits(at):
    with peer_on(at) as peer:
        with opened(at) as bus:
            heard(peer, 1, deadline_s=0.15)
            for number in range(50):
                bus.send(numbered(number))
            begun_s = time.monotonic()
        assert time.monotonic() - begun_s < 3  # 0.3 s are promised, of a machine that is not overloaded
        wait_for(lambda: bus.counters.sent + bus.dropped == 50)
        messages = heard(peer, bus.counters.sent)
        assert [int.from_bytes(m.data, "little") for m in messages] == list(range(bus.counters.sent))
        assert messages
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
            wait_for(lambda: bus.send(numbered(7)) or frames)  # until it listens
        finally:
            stop.set()
            listener.join(10.0)
        assert not listener.is_alive()
    assert {frame for _, frame in frames} == {numbered(7)}
    assert abs(time.time() - frames[0][0]) < 60


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
    assert time.monotonic() - begun_s < 5  # python-can alone would try for ten
