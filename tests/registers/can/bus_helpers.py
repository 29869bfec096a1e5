"""Helpers for tests on a CAN bus: an open connection, a python-can client, and numbered frames."""

import contextlib
import time

import can

from pneuforce.registers.can.connection import CanConnection
from pneuforce.registers.can.wire import CanFrame


@contextlib.contextmanager
def opened_connection(address, on_frame=lambda frame: None, transmit_ids=()):
    bus = CanConnection(address, on_frame)
    bus.open(transmit_ids)
    try:
        yield bus
    finally:
        bus.close()


@contextlib.contextmanager
def python_can_client(address):
    """Yield a bus that is opened with python-can, without code of this project."""
    options = {}
    if address.interface == "socketcand":
        options = {"host": address.host, "port": address.port, "tcp_tune": True}
    with can.Bus(
        interface=address.interface, channel=address.channel, ignore_config=True, **options
    ) as client:
        yield client


def numbered_frame(number, can_id=0x185):
    return CanFrame(can_id, number.to_bytes(8, "little"))


def message(number, **more):
    fields = {"arbitration_id": 0x205, "data": number.to_bytes(8, "little"), "is_extended_id": False}
    return can.Message(**(fields | more))


def received_messages(peer, count, deadline_s=15.0):
    """Return the next `count` messages, or fewer if the deadline passes first."""
    until_s, messages = time.monotonic() + deadline_s, []
    while len(messages) < count and time.monotonic() < until_s:
        received = peer.recv(0.1)
        messages += [received] if received is not None else []
    return messages
