"""The servers of others as processes, each as its own documentation has it."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from tests.hostile.case import Case, Wrong
from tests.hostile.cases import CASES
from tests.hostile.line import Server, answering
from tests.hostile.play import Outcome, played

_SERVERS = Path(__file__).parent / "servers"
_START_S = 10.0


@dataclass(frozen=True, slots=True)
class Rival:
    """A server of others; its program is run by `runner`, a path within the folder of tools."""

    name: str
    version: str
    language: str
    runner: str
    program: str = ""  #: of the folder `servers`; none where the runner is the program


RIVALS = (
    Rival("libmodbus", "3.1.6", "C", "stock_libmodbus"),
    Rival("pymodbus", "3.16.1", "Python", "bin/python", "stock_pymodbus.py"),
    Rival("pyModbusTCP", "0.3.1", "Python", "bin/python", "stock_pymodbustcp.py"),
    Rival("modbus_tk", "1.1.5", "Python", "bin/python", "stock_modbus_tk.py"),
    Rival("uModbus", "1.0.4", "Python", "bin/python", "stock_umodbus.py"),
    Rival("modbus-serial", "8.0.25", "JavaScript", "node", "stock_modbus_serial.js"),
    Rival("jsmodbus", "5.0.0", "JavaScript", "node", "stock_jsmodbus.js"),
)


def outcomes_of(rival: Rival, tools: Path) -> list[Outcome]:
    """What a rival makes of every case that is not about our map; it is started anew where it has ended."""
    server = Server(port=_free_port())
    command = [_runner(rival, tools), *filter(None, (rival.program and str(_SERVERS / rival.program),))]
    with _Process([*command, str(server.port)], tools) as process:
        return [_outcome(case, server, process) for case in CASES if not case.ours]


def _outcome(case: Case, server: Server, process: _Process) -> Outcome:
    process.make_sure(server)
    return played(case, server)


def _runner(rival: Rival, tools: Path) -> str:
    own = tools / rival.runner
    return str(own) if own.exists() else rival.runner


class _Process:
    """A server that is started again where it does not answer any more."""

    def __init__(self, command: list[str], tools: Path) -> None:
        self._command = command
        self._environment = os.environ | {"NODE_PATH": str(tools / "node_modules")}
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> _Process:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process:
            self._process.kill()
            self._process.wait()

    def make_sure(self, server: Server) -> None:
        """See that it answers. Raises Wrong where it cannot be started."""
        if self._process and self._process.poll() is None and _answers(server):
            return
        self.__exit__()
        self._process = subprocess.Popen(
            self._command, env=self._environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        until_s = time.monotonic() + _START_S
        while not _answers(server):
            if time.monotonic() > until_s:
                raise Wrong(f"{' '.join(self._command)} does not answer")
            time.sleep(0.05)


def _answers(server: Server) -> bool:
    try:
        answering(server)
    except Wrong:
        return False
    return True


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])
