"""Tests that run on each kind of bus: python-can's virtual bus, the hub, and vcan0 if the kernel has it.

Threads and sockets are real.
"""

import threading
import time
from itertools import count
from pathlib import Path

import can
import pytest

from pneuforce.registers.can.bus import CanAddress, listen
from pneuforce.registers.can.connection import CanConnection
from pneuforce.registers.can.frames import transmit_ids
from pneuforce.registers.can.wire import CanFrame, FrameKind
from tests.registers.can.bus_helpers import (
    message,
    numbered_frame,
    opened_connection,
    python_can_client,
    received_messages,
)
from tests.registers.can.conftest import wait_for

pytestmark = pytest.mark.usefixtures("no_frame_expiry")
_channels = count()
BURST = 2000


@pytest.fixture(params=["virtual", "socketcand", "socketcan"])
def address(request):
    if request.param == "virtual":
        return CanAddress(interface="virtual", channel=f"test-{next(_channels)}")
    if request.param == "socketcand":
        return CanAddress(interface="socketcand", port=request.getfixturevalue("hub_port"))
    if not Path("/sys/class/net/vcan0").exists():
        pytest.skip("this kernel has no vcan0; make one: ip link add vcan0 type vcan && ip link set vcan0 up")
    return CanAddress(interface="socketcan", channel="vcan0")


def with_id(can_id, kind=FrameKind.DATA, data=b"\x01"):
    return CanFrame(can_id, data, kind)


#: Identifiers of 11 and 29 bits, from the lowest to the highest, and every length of data.
FRAMES = [
    *(with_id(can_id) for can_id in (0, 0x085, 0x7FF)),
    *(with_id(can_id, FrameKind.EXTENDED) for can_id in (0, 0x205, 0x7FF, 0x800, 0x1FFF_FFFF)),
    *(with_id(0x185, data=bytes(range(0x41, 0x41 + length))) for length in range(9)),
    with_id(0x185, data=b"\xff" * 8),
]


def as_message(frame):
    return can.Message(
        arbitration_id=frame.id, data=frame.data, is_extended_id=bool(frame.kind & FrameKind.EXTENDED)
    )


def as_frame(message):
    kind = FrameKind.EXTENDED if message.is_extended_id else FrameKind.DATA
    return CanFrame(message.arbitration_id, bytes(message.data), kind)


def test_every_frame_arrives_unchanged_at_all_other_clients(address):
    with (
        opened_connection(address) as bus,
        python_can_client(address) as first,
        python_can_client(address) as second,
    ):
        for frame in FRAMES:
            bus.send(frame)
        for peer in (first, second):
            assert [as_frame(m) for m in received_messages(peer, len(FRAMES))] == FRAMES


def test_frames_of_other_clients_are_received_and_own_frames_are_not(address):
    got = []
    with opened_connection(address, got.append) as bus, python_can_client(address) as peer:
        bus.send(numbered_frame(1))
        for frame in FRAMES:
            peer.send(as_message(frame))
        wait_for(lambda: len(got) >= len(FRAMES))
        assert len(received_messages(peer, 1)) == 1
    assert got == FRAMES


def test_a_remote_frame_is_marked_as_remote_or_not_forwarded(address):
    """python-can's socketcand client sends a remote frame without data. Every server rejects such a frame."""
    got = []
    with opened_connection(address, got.append), python_can_client(address) as peer:
        peer.send(can.Message(arbitration_id=0x205, is_remote_frame=True, dlc=8, is_extended_id=False))
        peer.send(message(1))
        wait_for(lambda: got[-1:] == [numbered_frame(1, 0x205)])
    forwarded = [] if address.interface == "socketcand" else [with_id(0x205, FrameKind.REMOTE, b"")]
    assert got[:-1] == forwarded


def test_a_bus_that_is_opened_again_receives_no_frames_of_the_time_between(address):
    with python_can_client(address) as peer:
        for number in range(0, 30, 10):
            got = []
            with opened_connection(address, got.append) as bus:
                bus.send(numbered_frame(number))
                peer.send(message(number + 1))
                wait_for(lambda: got)  # noqa: B023
            peer.send(message(number + 2))
            assert got == [numbered_frame(number + 1, 0x205)]
        assert [int.from_bytes(m.data, "little") for m in received_messages(peer, 3)] == [0, 10, 20]


def test_a_burst_passes_in_both_directions_complete_and_in_order(address):
    got = []
    with opened_connection(address, got.append) as bus, python_can_client(address) as peer:
        for number in range(BURST):
            peer.send(message(number))
            if number % 100 == 99:  # the kernel buffers at most 277 frames for a client that does not read
                wait_for(lambda sent=number + 1: len(got) >= sent)
        for number in range(BURST):
            bus.send(numbered_frame(number))
            if number % 100 == 99:  # the transmit queue holds 256 frames and drops further ones
                wait_for(lambda sent=number + 1: bus.counters.sent == sent)
        messages = received_messages(peer, BURST)
    assert [int.from_bytes(frame.data, "little") for frame in got] == list(range(BURST))
    assert [int.from_bytes(m.data, "little") for m in messages] == list(range(BURST))
    assert bus.dropped == 0


def test_an_exception_of_the_callback_is_logged_and_the_next_frame_arrives(address, caplog):
    got = []

    def fail_once(frame):
        got.append(frame)
        if len(got) == 1:
            raise RuntimeError("error of the callback")

    with opened_connection(address, fail_once) as bus, python_can_client(address) as peer:
        peer.send(message(1))
        peer.send(message(2))
        wait_for(lambda: len(got) == 2)
        assert bus.is_up
        assert bus.counters.errors == 1
    assert "error of the callback" in caplog.text


def test_a_frame_is_sent_without_waiting_for_the_next(address):
    """Only the shortest of many delays is tested, because a busy machine lengthens the others."""
    with opened_connection(address) as bus, python_can_client(address) as peer:
        bus.send(numbered_frame(0))
        assert received_messages(peer, 1)
        delays_s = []
        for _ in range(200):
            started_s = time.perf_counter()
            bus.send(numbered_frame(1))
            assert received_messages(peer, 1)
            delays_s.append(time.perf_counter() - started_s)
    assert min(delays_s) < 0.005


def test_close_returns_soon_and_sends_the_frames_in_the_queue(address):
    with python_can_client(address) as peer:
        with opened_connection(address) as bus:
            received_messages(peer, 1, deadline_s=0.15)
            for number in range(50):
                bus.send(numbered_frame(number))
            started_s = time.monotonic()
        assert time.monotonic() - started_s < 3  # takes 0.3 s on an idle machine
        wait_for(lambda: bus.counters.sent + bus.dropped == 50)
        messages = received_messages(peer, bus.counters.sent)
        assert [int.from_bytes(m.data, "little") for m in messages] == list(range(bus.counters.sent))
        assert messages
    assert not bus.is_up


@pytest.mark.parametrize("sent", sorted(transmit_ids(5)), ids=hex)
def test_a_node_id_that_another_node_uses_is_rejected(address, sent):
    """Any frame of the other node shows its node id. A node without a heartbeat still sends process data."""
    stop = threading.Event()

    def send_again_and_again(peer):
        while not stop.wait(0.1):
            peer.send(message(0, arbitration_id=sent, data=b"\x05"))

    with python_can_client(address) as peer:
        other = threading.Thread(target=send_again_and_again, args=(peer,))
        other.start()
        try:
            with pytest.raises(OSError, match=rf"CAN node id 5 .* {sent:03X}h"):
                CanConnection(address, print).open(transmit_ids(5))
        finally:
            stop.set()
            other.join()


def test_a_free_node_id_is_used_after_listening_for_1_2_s(address):
    """Frames of other nodes, and frames with 29-bit identifiers, do not occupy a node id."""
    stop = threading.Event()

    def send_other_frames(peer):
        while not stop.wait(0.1):
            peer.send(message(0, arbitration_id=0x706, data=b"\x05"))
            peer.send(message(0))  # a Command to node 5, which node 5 itself never sends
            peer.send(message(0, arbitration_id=0x705, data=b"\x05", is_extended_id=True))

    with python_can_client(address) as peer:
        others = threading.Thread(target=send_other_frames, args=(peer,))
        others.start()
        try:
            started_s = time.monotonic()
            with opened_connection(address, transmit_ids=transmit_ids(5)) as bus:
                assert bus.is_up
                assert time.monotonic() - started_s >= 1.2
        finally:
            stop.set()
            others.join()


def test_listen_yields_all_traffic_until_it_is_stopped(address):
    stop, frames = threading.Event(), []
    with opened_connection(address) as bus:
        listener = threading.Thread(target=lambda: frames.extend(listen(address, stop)))
        listener.start()
        try:
            wait_for(lambda: bus.send(numbered_frame(7)) or frames)  # repeat until the listener is ready
        finally:
            stop.set()
            listener.join(10.0)
        assert not listener.is_alive()
    assert {frame for _, frame in frames} == {numbered_frame(7)}
    assert abs(time.time() - frames[0][0]) < 60


@pytest.mark.parametrize(
    ("address", "message_part"),
    [
        (
            CanAddress(interface="socketcand", port=1),
            r"can0 at 127\.0\.0\.1:1 .*Connection refused",
        ),
        (CanAddress(interface="socketcan", channel="none7"), "socketcan none7 "),
    ],
)
def test_a_missing_interface_raises_an_error_at_once(address, message_part):
    started_s = time.monotonic()
    with pytest.raises(OSError, match=message_part):
        CanConnection(address, print).open()
    assert time.monotonic() - started_s < 5  # python-can itself retries for 10 s
