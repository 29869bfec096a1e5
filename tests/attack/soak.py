"""Long run of the whole instrument, while clients of all kinds come and go."""

from __future__ import annotations

import random
import socket
import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from pneuforce.registers.map import COMMAND_KEY
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError
from pneuforce.teststand.stack import Stack, free_port, start
from tests.attack.can import OPEN, RAW, any_message, wait_until_joined
from tests.attack.modbus import adu
from tests.attack.page import REQUESTS
from tests.attack.result import AttackResult

SETPOINT_KPA, CYCLE_S, VENTED_S = 8.0, 60.0, 5.0
POLL_S = 0.05
CHURN_PER_S = 20  #: clients that connect, send something and leave
#: Growth that is allowed between a tenth of the time and its end.
MAX_GROWTH_MB, MAX_DESCRIPTORS, MAX_THREADS = 10.0, 80, 2


def attack_soak(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Run for `amount` seconds. Memory, descriptors and threads must not grow."""
    page = free_port()
    with TemporaryDirectory() as folder, ExitStack() as children:
        tables = {"web": {"enabled": True, "port": page}, "modbus": {"max_connections": 64}}
        stack = start(children, Path(folder) / "rig", ["--scenario", "taps"], tables)
        wait_until_joined(stack.modbus_port)
        ports = (stack.modbus_port, stack.can_port, page)
        events = Path(folder) / "events.sqlite"
        begun_s, before = time.monotonic(), None
        plc = _PollingPlc(stack, result)
        while (passed_s := time.monotonic() - begun_s) < amount:
            if before is None and passed_s > amount / 10:
                before = _occupied(stack, events)
            plc.step(passed_s)
            for _ in range(max(1, round(CHURN_PER_S * POLL_S))):
                _visit(rng, ports)
                result.sent += 1
            time.sleep(max(0.0, begun_s + passed_s + POLL_S - time.monotonic()))
        stack.check()
        _compare(result, before or _occupied(stack, events), _occupied(stack, events))
        result.check(not any("Traceback" in line for line in stack.host.stderr_lines), "a traceback")


class _PollingPlc:
    """PLC that polls, holds the balloon for most of each minute, and clears faults."""

    def __init__(self, stack: Stack, result: AttackResult) -> None:
        self._result = result
        self._client = ModbusClient.connect(port=stack.modbus_port, wait_s=5.0)
        self._stack = stack
        self._mode = ""

    def step(self, passed_s: float) -> None:
        """Poll once, and write what is due."""
        try:
            values = self._client.read()
            self._result.notes["polls"] += 1
            wanted = "vent" if passed_s % CYCLE_S < VENTED_S else "hold"
            if values["state"] == "tripped":
                self._result.notes["polls while tripped"] += 1
                self._clear(values)
                self._mode = ""
            elif wanted != self._mode:
                self._write(wanted)
        except ModbusClientError as error:
            self._result.notes["lost polls"] += 1
            self._result.check(False, f"the PLC lost its connection after {passed_s:.0f} s: {error}")
            time.sleep(POLL_S)
            self._stack.check()
            self._client = ModbusClient.connect(port=self._stack.modbus_port, wait_s=5.0)

    def _write(self, wanted: str) -> None:
        with suppress(ModbusClientError):  # another client may hold the lease or may have vented
            if wanted == "hold":
                self._client.write("mode", "vent")
                self._client.write("setpoint_requested", SETPOINT_KPA)
            self._client.write("mode", wanted)
            self._mode = wanted
            self._result.notes[wanted] += 1

    def _clear(self, values: dict[str, object]) -> None:
        with suppress(ModbusClientError):
            self._client.write("mode", "vent")
            self._client.write("command_key", COMMAND_KEY)
            self._client.write("command_code", "clear_faults")
            self._client.write("command_sequence", (int(str(values["answer_sequence"])) + 1) % 0x10000)


def _visit(rng: random.Random, ports: Sequence[int]) -> None:
    """Connect to one of the servers, send something, and leave in the middle."""
    kind = rng.randrange(3)
    data = (
        adu(rng),
        OPEN + RAW + any_message(rng),
        rng.choice(REQUESTS),
    )[kind]
    with suppress(OSError), socket.socket() as client:
        client.settimeout(0.2)
        client.bind((f"127.0.0.{rng.randint(2, 9)}", 0))
        client.connect(("127.0.0.1", ports[kind]))
        client.sendall(data[: rng.choice((len(data), len(data) // 2))])


def _occupied(stack: Stack, events: Path) -> dict[str, float]:
    """Return what the instrument and its web process use now."""
    host = psutil.Process(stack.host.pid)
    used = {"event log MB": sum(f.stat().st_size for f in events.parent.glob("events.sqlite*")) / 1e6}
    for name, process in zip(("host", "web"), (host, *host.children()), strict=False):
        used[f"{name} MB"] = process.memory_info().rss / 1e6
        used[f"{name} descriptors"] = process.num_fds()
        used[f"{name} threads"] = process.num_threads()
    return used


def _compare(result: AttackResult, before: dict[str, float], after: dict[str, float]) -> None:
    limits = {"MB": MAX_GROWTH_MB, "descriptors": MAX_DESCRIPTORS, "threads": MAX_THREADS}
    for name, value in after.items():
        growth = value - before.get(name, value)
        result.figures.append(f"{name} {value:.1f} ({growth:+.1f})")
        if not name.startswith("event log"):
            result.check(growth <= limits[name.split()[-1]], f"{name} grew by {growth:.1f}")
