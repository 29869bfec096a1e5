"""Test of the journal of an instrument to which a peer writes as fast as it can."""

import socket
import struct
import threading
import time
from contextlib import contextmanager, suppress

from pneuforce.registers.modbus.mbap import encode_frame
from tests.system.waiting import wait_for

FORCE_LIMIT = 545
PERIOD_S = 0.005


@contextmanager
def changing_writes(port):
    """Write another force limit 200 times per second while the with block runs."""
    ended = threading.Event()

    def write():
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=5) as peer:
            value_mn = 1000
            while not ended.wait(PERIOD_S):
                value_mn = 1000 + (value_mn + 1) % 5000
                peer.sendall(encode_frame(1, 1, struct.pack(">BHH", 6, FORCE_LIMIT, value_mn)))
                peer.recv(64)

    thread = threading.Thread(target=write)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def test_trips_and_the_end_are_logged_while_a_peer_writes_200_changing_values_per_second(stack):
    with stack.plc() as plc, changing_writes(stack.modbus_port):
        time.sleep(1.3)
        for fault, status in (("sensor_short", "sensor_fault"), ("line_cut", "link_lost")):
            stack.request(fault={"name": fault})
            wait_for(plc.read, lambda v, status=status: status in v["status"])
        stack.host.stop()
    log = "\n".join(stack.host.stderr_lines)
    for text in (
        "tripped: sensor ",
        "tripped: link lost ",
        "ended: the vent was sent, but not",
        "lines dropped before",
    ):
        assert text in log
