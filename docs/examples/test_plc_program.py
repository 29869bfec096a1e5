"""Test of a PLC program, written here in Python, against pneuforce with a simulated rig."""

import math
import struct
import threading
import time
from contextlib import contextmanager, suppress

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

ASSUMED_FORCE_N = 5.0  # the machine must assume this force while the force is unknown
MAX_AGE_MS = 100
NOT_USABLE = 1 << 8 | 1 << 9 | 1 << 31  # status bits: stale, link_lost, any_failure
LEASE_MS = 1000


class Program:
    """PLC program that renews the lease, reads the registers, and decides if the force may be used."""

    def __init__(self, port):
        self.client = ModbusTcpClient("127.0.0.1", port=port, timeout=0.5, retries=0)
        self.client.connect()
        self.force_n, self.valid = ASSUMED_FORCE_N, False

    def cycle(self):
        """Run one cycle of the program."""
        registers = None
        with suppress(ModbusException):  # without an answer, the force is unknown
            self.client.write_registers(517, [LEASE_MS])  # to unit 1, the default
            registers = self.client.read_input_registers(0, count=36).registers
        self.valid, self.force_n = self._check(registers) if registers else (False, ASSUMED_FORCE_N)

    def _check(self, registers):
        """Return validity and force. All values of one request belong to one sample; high word first."""
        (force_n,) = struct.unpack(">f", struct.pack(">2H", *registers[0:2]))
        status = registers[20] << 16 | registers[21]
        valid = math.isfinite(force_n) and not status & NOT_USABLE and registers[24] <= MAX_AGE_MS
        return valid, force_n if valid else ASSUMED_FORCE_N


@contextmanager
def running(program):
    """Run the program every 20 ms in a thread."""
    stop = threading.Event()

    def run():
        while not stop.wait(0.02):
            program.cycle()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield program
    finally:
        stop.set()
        thread.join()
        program.client.close()


def wait_until(condition, seconds=5.0):
    deadline_s = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline_s, "the condition was not met in time"
        time.sleep(0.01)


def test_the_program_uses_a_valid_force_and_assumes_the_highest_force_otherwise(pneuforce_rig):
    with running(Program(pneuforce_rig.modbus_port)) as program:
        assert (program.force_n, program.valid) == (ASSUMED_FORCE_N, False)  # no force while vented
        pneuforce_rig.inflate(6.0)
        pneuforce_rig.press(2.0)
        wait_until(lambda: program.valid)
        assert program.force_n == pytest.approx(pneuforce_rig.truth()["force_n"], abs=0.1)
        with pneuforce_rig.inject_fault("line_cut"):  # the line between rig and instrument
            wait_until(lambda: not program.valid, seconds=1.0)
        assert program.force_n == ASSUMED_FORCE_N


@pytest.mark.pneuforce(seed=7)
def test_when_the_connection_stalls_the_force_is_invalid_and_the_balloon_is_vented(
    pneuforce_rig, pneuforce_tcp_proxy
):
    connection = pneuforce_tcp_proxy.noise
    connection.delay_s, connection.max_chunk_bytes = 0.005, 7  # delayed and split answers must do no harm
    with running(Program(pneuforce_tcp_proxy.port)) as program:
        pneuforce_rig.inflate(6.0)
        wait_until(lambda: program.valid)
        connection.stalled = True
        wait_until(lambda: not program.valid)
        vented = pneuforce_rig.wait_for(lambda registers: "vented" in registers["status"], allow_trip=True)
        assert "lease_expired" in vented["status"]
