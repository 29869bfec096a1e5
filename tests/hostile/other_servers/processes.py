"""Other Modbus servers as processes, started as their documentation shows."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from tests.hostile.case import CaseFailure, HostileCase
from tests.hostile.cases import CASES
from tests.hostile.connection import ServerUnderTest, check_answers
from tests.hostile.runner import CaseResult, run_case

_SERVERS = Path(__file__).parent / "servers"
_START_S = 10.0


@dataclass(frozen=True, slots=True)
class OtherServer:
    """Modbus server of another project. `runner` is its interpreter or program in the folder of tools."""

    name: str
    version: str
    language: str
    runner: str
    program: str = ""  #: script in the folder `servers`; empty if `runner` is the program


OTHER_SERVERS = (
    OtherServer("libmodbus", "3.1.6", "C", "stock_libmodbus"),
    OtherServer("pymodbus", "3.16.1", "Python", "bin/python", "stock_pymodbus.py"),
    OtherServer("pyModbusTCP", "0.3.1", "Python", "bin/python", "stock_pymodbustcp.py"),
    OtherServer("modbus_tk", "1.1.5", "Python", "bin/python", "stock_modbus_tk.py"),
    OtherServer("uModbus", "1.0.4", "Python", "bin/python", "stock_umodbus.py"),
    OtherServer("modbus-serial", "8.0.25", "JavaScript", "node", "stock_modbus_serial.js"),
    OtherServer("jsmodbus", "5.0.0", "JavaScript", "node", "stock_jsmodbus.js"),
)


def results_of(other_server: OtherServer, tools: Path) -> list[CaseResult]:
    """Run every generic case with a server. The server is restarted if it has ended. Return the results."""
    server = ServerUnderTest(port=_free_port())
    command = [
        _runner(other_server, tools),
        *filter(None, (other_server.program and str(_SERVERS / other_server.program),)),
    ]
    with _Process([*command, str(server.port)], tools) as process:
        return [_result_of(case, server, process) for case in CASES if not case.needs_pneuforce]


def _result_of(case: HostileCase, server: ServerUnderTest, process: _Process) -> CaseResult:
    process.ensure_running(server)
    return run_case(case, server)


def _runner(other_server: OtherServer, tools: Path) -> str:
    path = tools / other_server.runner
    return str(path) if path.exists() else other_server.runner


class _Process:
    """Server process that is restarted if it no longer answers."""

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

    def ensure_running(self, server: ServerUnderTest) -> None:
        """Restart the server if it does not answer. Raises CaseFailure if it cannot be started."""
        if self._process and self._process.poll() is None and _answers(server):
            return
        self.__exit__()
        self._process = subprocess.Popen(
            self._command, env=self._environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        until_s = time.monotonic() + _START_S
        while not _answers(server):
            if time.monotonic() > until_s:
                raise CaseFailure(f"{' '.join(self._command)} does not answer")
            time.sleep(0.05)


def _answers(server: ServerUnderTest) -> bool:
    try:
        check_answers(server)
    except CaseFailure:
        return False
    return True


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])
