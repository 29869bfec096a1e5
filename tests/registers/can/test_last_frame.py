"""Test that the last frame before the close of a bus arrives, although the bus has unread frames."""

import time
from contextlib import closing, contextmanager

import can

from pneuforce.registers.can.bus import CanAddress, CanBus
from pneuforce.registers.can.wire import CanFrame
from tests.background import repeated
from tests.registers.can.conftest import wait_for


def test_a_frame_arrives_that_is_sent_before_the_close_of_a_bus_with_unread_frames(hub_port):
    address = CanAddress(interface="socketcand", port=hub_port)
    with sending_1000_frames_per_s(address), watching(hub_port) as received:
        buses = [CanBus(address) for _ in range(12)]
        time.sleep(1.0)
        for n, bus in enumerate(buses):
            bus.send(CanFrame(0x205, bytes([n])))
            bus.close()
        wait_for(lambda: len(received) == 12)
    assert [message.data for message in received] == [bytes([n]) for n in range(12)]


@contextmanager
def watching(port):
    """Yield the list of all frames 205h that arrive until the block ends."""
    received = []
    with can.Bus(
        interface="socketcand",
        channel="can0",
        host="127.0.0.1",
        port=port,
        can_filters=[{"can_id": 0x205, "can_mask": 0x7FF}],
    ) as bus:
        reader = can.Notifier(bus, [received.append])
        try:
            yield received
        finally:
            reader.stop()


@contextmanager
def sending_1000_frames_per_s(address):
    """Send frames in a thread until the block ends."""
    with closing(CanBus(address)) as bus:

        def send():
            bus.send(CanFrame(0x185, bytes(8)))
            bus.receive(0.0)

        with repeated(send, 0.001):
            yield
