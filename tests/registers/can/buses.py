"""A live bus of ours, somebody else's client beside it, and frames that tell which they are."""

import contextlib
import time

import can

from registers.can.live import CanBus
from registers.can.wire import CanFrame


@contextlib.contextmanager
def opened(at, on_frame=lambda frame: None, own_ids=()):
    bus = CanBus(at, on_frame)
    bus.open(own_ids)
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


def heard(peer, how_many, deadline_s=15.0):
    until_s, messages = time.monotonic() + deadline_s, []
    while len(messages) < how_many and time.monotonic() < until_s:
        received = peer.recv(0.1)
        messages += [received] if received is not None else []
    return messages
