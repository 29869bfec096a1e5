"""One contract on every kind of bus: python-can's virtual one, the hub, and the kernel's where it has one.

With real threads and real sockets.
"""

import threading
import time
from itertools import count
from pathlib import Path

import can
import pytest

from registers.can.bus import BusAt, listen
from registers.can.frames import sent_ids
from registers.can.live import CanBus
from registers.can.wire import CanFrame, Kind
from tests.registers.can.buses import heard, message, numbered, opened, peer_on
from tests.registers.can.conftest import wait_for

pytestmark = pytest.mark.usefixtures("frames_stay_fresh")
_channels = count()
BURST = 2000


@pytest.fixture(params=["virtual", "socketcand", "socketcan"])
def at(request):
    if request.param == "virtual":
        return BusAt(interface="virtual", channel=f"test-{next(_channels)}")
    if request.param == "socketcand":
        return BusAt(interface="socketcand", port=request.getfixturevalue("hub_port"))
    if not Path("/sys/class/net/vcan0").exists():
        pytest.skip("this kernel has no vcan0; make one: ip link add vcan0 type vcan && ip link set vcan0 up")
    return BusAt(interface="socketcan", channel="vcan0")


def with_id(can_id, kind=Kind.DATA, data=b"\x01"):
    return CanFrame(can_id, data, kind)


#: What may be sent: both lengths of identifier, from the lowest to the highest, and every length of data.
FRAMES = [
    *(with_id(can_id) for can_id in (0, 0x085, 0x7FF)),
    *(with_id(can_id, Kind.EXTENDED) for can_id in (0, 0x205, 0x7FF, 0x800, 0x1FFF_FFFF)),
    *(with_id(0x185, data=bytes(range(0x41, 0x41 + length))) for length in range(9)),
    with_id(0x185, data=b"\xff" * 8),
]


def as_message(frame):
    return can.Message(
        arbitration_id=frame.id, data=frame.data, is_extended_id=bool(frame.kind & Kind.EXTENDED)
    )


def as_frame(message):
    kind = Kind.EXTENDED if message.is_extended_id else Kind.DATA
    return CanFrame(message.arbitration_id, bytes(message.data), kind)


def test_every_frame_arrives_as_it_was_sent_with_everybody(at):
    with opened(at) as bus, peer_on(at) as first, peer_on(at) as second:
        for frame in FRAMES:
            bus.send(frame)
        for peer in (first, second):
            assert [as_frame(m) for m in heard(peer, len(FRAMES))] == FRAMES


def test_every_frame_of_others_arrives_and_our_own_do_not(at):
    got = []
    with opened(at, got.append) as bus, peer_on(at) as peer:
        bus.send(numbered(1))
        for frame in FRAMES:
            peer.send(as_message(frame))
        wait_for(lambda: len(got) >= len(FRAMES))
        assert len(heard(peer, 1)) == 1
    assert got == FRAMES


def test_a_remote_frame_is_told_from_data_or_not_carried(at):
    """python-can's socketcand client sends a length without its data, which no socketcand server takes."""
    got = []
    with opened(at, got.append), peer_on(at) as peer:
        peer.send(can.Message(arbitration_id=0x205, is_remote_frame=True, dlc=8, is_extended_id=False))
        peer.send(message(1))
        wait_for(lambda: got[-1:] == [numbered(1, 0x205)])
    carried = [] if at.interface == "socketcand" else [with_id(0x205, Kind.REMOTE, b"")]
    assert got[:-1] == carried


def test_a_bus_opened_again_carries_on_and_hears_nothing_of_the_time_between(at):
    with peer_on(at) as peer:
        for number in range(0, 30, 10):
            got = []
            with opened(at, got.append) as bus:
                bus.send(numbered(number))
                peer.send(message(number + 1))
                wait_for(lambda: got)  # noqa: B023
            peer.send(message(number + 2))
            assert got == [numbered(number + 1, 0x205)]
        assert [int.from_bytes(m.data, "little") for m in heard(peer, 3)] == [0, 10, 20]


def test_a_burst_passes_both_ways_without_loss_and_in_order(at):
    got = []
    with opened(at, got.append) as bus, peer_on(at) as peer:
        for number in range(BURST):
            peer.send(message(number))
            if number % 100 == 99:  # a kernel keeps 277 for who does not read
                wait_for(lambda sent=number + 1: len(got) >= sent)
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


@pytest.mark.parametrize("sent", sorted(sent_ids(5)), ids=hex)
def test_a_node_id_that_another_node_uses_is_refused_in_a_sentence(at, sent):
    """Whichever of its frames betrays it: one without a heartbeat has its process data."""
    stop = threading.Event()

    def beat(peer):
        while not stop.wait(0.1):
            peer.send(message(0, arbitration_id=sent, data=b"\x05"))

    with peer_on(at) as peer:
        other = threading.Thread(target=beat, args=(peer,))
        other.start()
        try:
            with pytest.raises(OSError, match=rf"CAN node id 5 is taken on .* node sends {sent:03X}h"):
                CanBus(at, print).open(sent_ids(5))
        finally:
            stop.set()
            other.join()


def test_a_free_node_id_is_taken_after_listening(at):
    """Beside other nodes, and one whose frames have the same number in 29 bits."""
    stop = threading.Event()

    def chatter(peer):
        while not stop.wait(0.1):
            peer.send(message(0, arbitration_id=0x706, data=b"\x05"))
            peer.send(message(0))  # a Command to the one that is to come
            peer.send(message(0, arbitration_id=0x705, data=b"\x05", is_extended_id=True))

    with peer_on(at) as peer:
        others = threading.Thread(target=chatter, args=(peer,))
        others.start()
        try:
            begun_s = time.monotonic()
            with opened(at, own_ids=sent_ids(5)) as bus:
                assert bus.is_up
                assert time.monotonic() - begun_s >= 1.2
        finally:
            stop.set()
            others.join()


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
