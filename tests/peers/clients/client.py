"""Modbus clients of other projects, run as processes that read requests and print answers line by line."""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.tools import needs

HERE = Path(__file__).parent
BUILD = Path(__file__).parents[3] / "build" / "peers"
MODULES = BUILD / "node_modules"
NODE = shutil.which("node") or str(Path(sys.executable).with_name("node"))

NEEDS_LIBMODBUS = needs("libmodbus-dev", "/usr/include/modbus/modbus.h")
NEEDS_NODE = pytest.mark.skipif(
    not MODULES.exists() and not os.environ.get("CI"),
    reason="the clients of npm are missing: make test installs them (apt-get install npm)",
)

PYTHON = (sys.executable, str(HERE / "with_pymodbus.py"))
COMMON_REQUESTS = frozenset(
    ("words", "bits", "float", "float_write", "word_write", "words_write", "coil_write", "coils_write")
)
ANSWER_TIMEOUT_S = 20.0
FURTHER_REQUESTS = frozenset(("mask", "exchange", "server_id"))


@dataclass(frozen=True, slots=True)
class ModbusClientProgram:
    """Client program and the requests that it supports."""

    name: str
    command: tuple[str, ...]
    requests: frozenset[str]
    needs: tuple[pytest.MarkDecorator, ...] = ()
    not_over_rtu: frozenset[str] = (
        frozenset()
    )  #: requests whose answers the client does not recognise on a serial line


CLIENTS = (
    ModbusClientProgram(
        "libmodbus",
        (str(BUILD / "libmodbus"),),
        COMMON_REQUESTS | FURTHER_REQUESTS,
        (NEEDS_LIBMODBUS, needs("gcc")),
    ),
    ModbusClientProgram(
        "pymodbus", (*PYTHON, "sync"), COMMON_REQUESTS | FURTHER_REQUESTS | {"identity", "echo"}
    ),
    ModbusClientProgram(
        "pymodbus-async",
        (*PYTHON, "async"),
        COMMON_REQUESTS | FURTHER_REQUESTS | {"identity", "echo", "together"},
    ),
    ModbusClientProgram(
        "modbus-serial",
        (NODE, str(HERE / "modbus_serial.js")),
        COMMON_REQUESTS | FURTHER_REQUESTS | {"identity", "together"},
        (NEEDS_NODE,),
        frozenset(("mask", "exchange", "identity")),  # identity: fails if an object has an empty text
    ),
    ModbusClientProgram(
        "jsmodbus",
        (NODE, str(HERE / "jsmodbus.js")),
        COMMON_REQUESTS | {"identity", "together"},
        (NEEDS_NODE,),
        frozenset(("identity",)),
    ),
)
#: Word order of 32-bit values on each transport. The instrument in these tests is configured in this way.
ORDERS = {"tcp": "ABCD", "rtu": "CDAB"}


def compile_libmodbus_client():
    """Compile the client program that uses libmodbus."""
    BUILD.mkdir(parents=True, exist_ok=True)
    source, program = HERE / "libmodbus.c", BUILD / "libmodbus"
    flags = ["-Wall", "-Wextra", "-Werror", "-isystem", "/usr/include/modbus"]
    subprocess.run(["gcc", *flags, str(source), "-o", str(program), "-lmodbus"], check=True)


class RunningClient:
    """Running client program with a connection to the instrument."""

    def __init__(self, client: ModbusClientProgram, transport: str, target: str | int) -> None:
        self.client = client
        self.order = ORDERS[transport]
        self._supported = client.requests - (client.not_over_rtu if transport == "rtu" else frozenset())
        if client.name == "libmodbus":
            compile_libmodbus_client()
        self._process = subprocess.Popen(
            [*client.command, transport, str(target)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"NODE_PATH": str(MODULES)},
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait()
        self._process.stdin.close()
        self._process.stdout.close()

    def __call__(self, request):
        """Send `request`, with {order} replaced by the word order, and return the answer."""
        self._process.stdin.write(request.format(order=self.order) + "\n")
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], ANSWER_TIMEOUT_S)[0]:
            pytest.fail(f"{self.client.name} does not answer {request}")
        return json.loads(self._process.stdout.readline())

    def supports(self, request):
        """Return True if the client supports a request on its transport."""
        return request.split()[0] in self._supported
