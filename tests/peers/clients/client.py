"""Clients that others wrote, as processes: a request a line, answered by a line of JSON."""

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
    reason="npm's clients are missing: make test installs them (apt-get install npm)",
)

PYTHON = (sys.executable, str(HERE / "with_pymodbus.py"))
ALL_OFFER = frozenset(("words", "bits", "float", "put_float", "word", "put", "coil", "coils"))
PATIENCE_S = 20.0
MORE = frozenset(("mask", "exchange", "server_id"))


@dataclass(frozen=True, slots=True)
class Client:
    """One client, and the requests that it can make."""

    name: str
    command: tuple[str, ...]
    requests: frozenset[str]
    needs: tuple[pytest.MarkDecorator, ...] = ()
    not_on_a_line: frozenset[str] = (
        frozenset()
    )  #: their answers it does not find in what a serial line brings


CLIENTS = (
    Client("libmodbus", (str(BUILD / "libmodbus"),), ALL_OFFER | MORE, (NEEDS_LIBMODBUS, needs("gcc"))),
    Client("pymodbus", (*PYTHON, "sync"), ALL_OFFER | MORE | {"identity", "echo"}),
    Client("pymodbus-async", (*PYTHON, "async"), ALL_OFFER | MORE | {"identity", "echo", "together"}),
    Client(
        "modbus-serial",
        (NODE, str(HERE / "modbus_serial.js")),
        ALL_OFFER | MORE | {"identity", "together"},
        (NEEDS_NODE,),
        frozenset(("mask", "exchange", "identity")),  # the last where an object has no text
    ),
    Client(
        "jsmodbus",
        (NODE, str(HERE / "jsmodbus.js")),
        ALL_OFFER | {"identity", "together"},
        (NEEDS_NODE,),
        frozenset(("identity",)),
    ),
)
#: Of 32-bit values, by wire: the instrument in these tests shows both.
ORDERS = {"tcp": "ABCD", "rtu": "CDAB"}


def compiled_libmodbus():
    """Compile the program that asks by libmodbus."""
    BUILD.mkdir(parents=True, exist_ok=True)
    source, program = HERE / "libmodbus.c", BUILD / "libmodbus"
    flags = ["-Wall", "-Wextra", "-Werror", "-isystem", "/usr/include/modbus"]
    subprocess.run(["gcc", *flags, str(source), "-o", str(program), "-lmodbus"], check=True)


class Asking:
    """A running client that has connected."""

    def __init__(self, client: Client, wire: str, where: str | int) -> None:
        self.client = client
        self.order = ORDERS[wire]
        self._offered = client.requests - (client.not_on_a_line if wire == "rtu" else frozenset())
        if client.name == "libmodbus":
            compiled_libmodbus()
        self._process = subprocess.Popen(
            [*client.command, wire, str(where)],
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
        """The answer to `request`, in which {order} is this wire's order of words."""
        self._process.stdin.write(request.format(order=self.order) + "\n")
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], PATIENCE_S)[0]:
            pytest.fail(f"{self.client.name} has no answer to {request}")
        return json.loads(self._process.stdout.readline())

    def offers(self, request):
        """Whether the client can make a request on its wire."""
        return request.split()[0] in self._offered
