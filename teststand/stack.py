"""Start of simulator, CAN hub and instrument as processes that are connected to each other."""

from __future__ import annotations

import errno
import json
import secrets
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from typing import Any

from pneuforce.errors import PneuforceError, ServerError
from pneuforce.registers.can.frames import DEFAULT_NODE_ID
from pneuforce.registers.modbus.client_errors import NoAnswerError
from pneuforce.sim.line.proxy import SerialProxy
from pneuforce.sim.server.client import SimulatorNotResponding
from pneuforce.teststand.child_process import ChildProcess

PORT_ERRORS: Mapping[int | None, str] = {
    errno.EADDRINUSE: "is in use by another program",
    errno.EACCES: "needs privileges that you do not have",
}
Tables = Mapping[str, Mapping[str, Any]]
#: Ports below those that Linux assigns to clients (32768 to 60999, net.ipv4.ip_local_port_range).
_SERVER_PORTS = range(10_000, 32_768)
_ATTEMPTS = 100
#: Longest time from the lost connection of a killed process to its end. A busy computer needs the most.
END_TIMEOUT_S = 0.5
END_POLL_S = 0.01


@dataclass(frozen=True, slots=True)
class Stack:
    """Running processes and their ports."""

    sim: ChildProcess
    hub: ChildProcess
    host: ChildProcess
    modbus_port: int
    can_port: int
    control_port: int
    local_socket: Path  #: local socket of the instrument, for recorders
    line: SerialProxy | None  #: disturbable serial line between rig and instrument
    can_node: int = DEFAULT_NODE_ID
    ports: Mapping[str, int | None] = field(default_factory=dict)  #: in the JSON line of the instrument

    @property
    def children(self) -> tuple[ChildProcess, ...]:
        """Return the processes. The instrument is the last, because it ends when the hub has ended."""
        return self.hub, self.sim, self.host

    def check(self) -> None:
        """Raise ChildProcessFailed, with the reason, if one of the processes has ended unexpectedly."""
        for child in self.children:
            if not child.running and not child.killed:
                raise child.failure() from None  # the end explains all errors before

    def check_at_end(self) -> None:
        """Raise ChildProcessFailed if a process has ended and no call has raised this error before."""
        if not any(child.reported for child in self.children):
            self.check()

    def printed(self) -> str:
        """Return the last lines that each process has printed."""
        return "\n".join(f"[{child.name}] {line}" for child in self.children for line in child.stderr_lines)

    @contextmanager
    def checked(self) -> Iterator[None]:
        """Raise ChildProcessFailed instead of another error if one of the processes has ended.

        Linux closes the connections of a killed process before its parent process can see the end.
        """
        self.check()
        try:
            yield
        except PneuforceError as error:
            waits = isinstance(error, NoAnswerError | SimulatorNotResponding)
            until_s = time.monotonic() + (END_TIMEOUT_S if waits else 0.0)
            self.check()
            while time.monotonic() < until_s:
                time.sleep(END_POLL_S)
                self.check()
            raise


def start(
    children: ExitStack,
    link: Path,
    rig: Sequence[str] = (),
    tables: Tables | None = None,
    *,
    stop: Event | None = None,
    line_seed: int | None = None,
) -> Stack:
    """Start simulator, hub and instrument as processes that `children` ends, the instrument first.

    The simulator is started with the arguments `rig`. `tables` is the configuration of the instrument. If a
    port is missing in `tables`, a free port is used. With `line_seed`, a disturbable line connects rig and
    instrument.

    Raises ChildProcessFailed if a process does not start, StartCancelled if `stop` is set before the end of
    the start.
    """
    given = {name: dict(table) for name, table in (tables or {}).items()}
    parameter_file = str(link.with_name("canopen.json"))
    can_defaults = {"enabled": True, "interface": "socketcand", "parameter_file": parameter_file}
    can = {**can_defaults, **given.get("can", {})}
    modbus = {"port": reserve_port(children), **given.get("modbus", {})}
    sim = children.enter_context(
        ChildProcess("simulator", ["pneuforce", "sim", "run", "--link", str(link), *rig])
    )
    hub = children.enter_context(
        ChildProcess("CAN hub", ["pneuforce.registers.can.hub", "--port", str(can.get("port", 0))])
    )
    # Entered before the instrument, so that the line ends after the instrument.
    line_stack = children.enter_context(ExitStack())
    host = children.enter_context(ChildProcess("instrument", ["pneuforce", "run", "--config", "/dev/stdin"]))
    can["port"] = hub.ready(stop)["port"]
    control_port = sim.ready(stop)["control"]
    line = None if line_seed is None else line_stack.enter_context(SerialProxy(str(link), seed=line_seed))
    rig_table = {**given.get("rig", {}), "port": line.port if line else str(link)}
    events = {"file": str(link.with_name("events.sqlite")), **given.get("events", {})}
    local = {"socket": str(link.with_name("pneuforce.sock")), **given.get("local", {})}
    host.write_stdin(
        toml({**given, "rig": rig_table, "modbus": modbus, "can": can, "events": events, "local": local})
    )
    ports = host.ready(stop)  # before the instrument is ready, another program could answer on its port
    node_id = can.get("node_id", DEFAULT_NODE_ID)
    served = modbus["port"], can["port"], control_port, Path(str(local["socket"]))
    return Stack(sim, hub, host, *served, line, node_id, ports)


def toml(tables: Tables) -> str:
    """Return the tables as TOML. JSON and TOML have the same syntax for the values of these tables."""
    lines = []
    for name, table in tables.items():
        lines += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def check_ports_free(ports: Mapping[str, int]) -> None:
    """Raise ServerError if a TCP port cannot be used. `ports` maps the names of the options to the ports."""
    for option, port in ports.items():
        try:
            socket.create_server(("127.0.0.1", port)).close()
        except OSError as error:
            why = PORT_ERRORS.get(error.errno, f"cannot be used ({error.strerror})")
            raise ServerError(f"--{option} {port} {why}: choose another port") from None


def reserve_port(reservation: ExitStack) -> int:
    """Return a free TCP port of the loopback interface, and reserve the port until `reservation` ends.

    A server can bind the port. The system does not assign the port to other sockets.
    """
    reserved = reservation.enter_context(socket.socket())
    reserved.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # lets a server bind the same port
    reserved.bind(("127.0.0.1", 0))
    port: int = reserved.getsockname()[1]
    return port


def free_port() -> int:
    """Return a TCP port of the loopback interface that is free now.

    The system never assigns this port to a client, so a server can still bind it a second later, even if many
    clients connect meanwhile. Raises OSError if no free port is found.
    """
    for _ in range(_ATTEMPTS):
        port = _SERVER_PORTS[secrets.randbelow(len(_SERVER_PORTS))]
        with suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return port
    raise OSError(f"no free TCP port was found between {_SERVER_PORTS[0]} and {_SERVER_PORTS[-1]}")
