"""A PLC program, here a few lines of Python, tested against pneuforce on a simulated rig."""

import math
import struct
import threading
import time
from contextlib import contextmanager, suppress

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

HIGHEST_FORCE_N = 5.0  # what the machine must assume while it does not know the force
OLD_MS = 100
LOST_OR_STALE = 1 << 8 | 1 << 9  # status bits 8 and 9
LEASE_MS = 1000


class Program:
    """One cycle: renew the lease, read the block, decide whether the force may be used."""

    def __init__(self, port):
        self.client = ModbusTcpClient("127.0.0.1", port=port, timeout=0.5, retries=0)
        self.client.connect()
        self.force_n, self.valid = HIGHEST_FORCE_N, False

    def cycle(self):
        words = None
        with suppress(ModbusException):  # no answer is no force
            self.client.write_registers(517, [LEASE_MS], device_id=1)
            words = self.client.read_input_registers(0, count=36, device_id=1).registers
        self.valid, self.force_n = self._checked(words) if words else (False, HIGHEST_FORCE_N)

    def _checked(self, words):
        """One request, so all values are of one instant. The high word comes first."""
        (force_n,) = struct.unpack(">f", struct.pack(">2H", *words[0:2]))
        status = words[20] << 16 | words[21]
        valid = math.isfinite(force_n) and not status & LOST_OR_STALE and words[24] <= OLD_MS
        return valid, force_n if valid else HIGHEST_FORCE_N


@contextmanager
def running(program):
    """The program in its cycle of 20 ms, beside the test."""
    ended = threading.Event()

    def run():
        while not ended.wait(0.02):
            program.cycle()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield program
    finally:
        ended.set()
        thread.join()


def until(wanted, seconds=5.0):
    end_s = time.monotonic() + seconds
    while not wanted():
        assert time.monotonic() < end_s, "what was waited for did not come"
        time.sleep(0.01)


def test_it_uses_a_force_that_is_valid_and_assumes_the_highest_without_one(pneuforce_rig):
    with running(Program(pneuforce_rig.modbus_port)) as program:
        assert (program.force_n, program.valid) == (HIGHEST_FORCE_N, False)  # vented: no force
        pneuforce_rig.inflate(6.0)
        pneuforce_rig.press(2.0)
        until(lambda: program.valid)
        assert program.force_n == pytest.approx(pneuforce_rig.truth()["force_n"], abs=0.1)
        with pneuforce_rig.fault("line_cut"):  # between rig and instrument
            until(lambda: not program.valid, seconds=1.0)
        assert program.force_n == HIGHEST_FORCE_N


@pytest.mark.pneuforce(seed=7)
def test_when_its_line_stalls_it_has_no_force_and_the_balloon_is_vented(pneuforce_rig, pneuforce_tcp_proxy):
    line = pneuforce_tcp_proxy.noise
    line.delay_s, line.most_bytes = 0.005, 7  # late and in pieces: that must not disturb it
    with running(Program(pneuforce_tcp_proxy.port)) as program:
        pneuforce_rig.inflate(6.0)
        until(lambda: program.valid)
        line.stalled = True
        until(lambda: not program.valid)
        vented = pneuforce_rig.wait_for(lambda registers: "vented" in registers["status"])
        assert "lease_expired" in vented["status"]
