"""Instrument under attack, and the PLC that must not notice the attack."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError
from pneuforce.teststand.stack import Stack, Tables, start
from tests.attack.result import AttackResult
from tests.system.waiting import inflate, wait_for

LEASE_S = 30.0
POLL_S = 0.05
SETPOINT_KPA = 8.0


class Plc(threading.Thread):
    """PLC that polls 20 times per second and holds the lease of the vented rig.

    No other client may inflate the balloon meanwhile.
    """

    def __init__(self, port: int, result: AttackResult) -> None:
        super().__init__(daemon=True)
        self._port, self._result = port, result
        self._ended = threading.Event()
        self._connection = ModbusClient.connect(port=port)
        self._connection.write("lease", LEASE_S)

    def run(self) -> None:
        """Poll until `stop`. Each lost connection and each inflation is a finding."""
        renewed_s = time.monotonic()
        while not self._ended.wait(POLL_S):
            try:
                if time.monotonic() > renewed_s + 1.0:
                    self._connection.write("lease", LEASE_S)
                    renewed_s = time.monotonic()
                values = self._connection.read()
            except ModbusClientError as error:
                self._result.check(False, f"the PLC lost its connection: {error}")
                return
            self._result.notes["polls of the PLC"] += 1
            self._result.check(values["state"] == "vented", f"the state became {values['state']}")
            self._result.check("force_valid" not in values["status"], "a force was shown as valid")

    def stop(self) -> None:
        """Stop polling, inflate and vent: the instrument must still work."""
        self._ended.set()
        self.join(5.0)
        with self._connection, ModbusClient.connect(port=self._port, wait_s=5.0) as plc:
            plc.write("lease", 0)
            inflate(plc, SETPOINT_KPA)
            plc.write("mode", "vent")
            wait_for(plc.read, lambda values: values["state"] == "vented")


@contextmanager
def attacked(result: AttackResult, tables: Tables | None = None) -> Iterator[Stack]:
    """Start an instrument with its PLC. Check both at the end of the attack."""
    with TemporaryDirectory() as folder, ExitStack() as children:
        stack = start(children, Path(folder) / "rig", ["--no-hand"], tables)
        with ModbusClient.connect(port=stack.modbus_port) as client:
            wait_for(client.read, lambda values: "not_zeroed" not in values["status"])
        plc = Plc(stack.modbus_port, result)
        plc.start()
        yield stack
        try:
            plc.stop()
        except (ModbusClientError, pytest.fail.Exception) as error:
            result.check(False, f"after the attack, the instrument does not work: {error}")
        stack.check()
        lines = [*stack.host.stderr_lines, *stack.hub.stderr_lines, *stack.sim.stderr_lines]
        result.check(not any("Traceback" in line for line in lines), "a process printed a traceback")
