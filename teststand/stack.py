"""Simulator, CAN hub and instrument, started at once; each hears where the others are when they are there."""

from __future__ import annotations

import json
import socket
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

from sim.proxy import SerialProxy
from teststand.children import Child

Tables = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True, slots=True)
class Stack:
    """The running processes, and where they are to be found."""

    sim: Child
    hub: Child
    host: Child
    modbus_port: int
    can_port: int
    control_port: int
    line: SerialProxy | None  #: between rig and instrument

    def check(self) -> None:
        """Raises ChildFailed, in its own last words, where one of them has ended."""
        for child in (self.host, self.sim, self.hub):
            if not child.running:
                raise child.failure()


def start(
    children: ExitStack,
    link: Path,
    rig: Sequence[str] = (),
    tables: Tables | None = None,
    *,
    stop: Event | None = None,
    line_seed: int | None = None,
) -> Stack:
    """Start all three; they end with `children`, the instrument first.

    `rig` is what the simulator is started with, `tables` are tables of the instrument.toml; a port that they
    do not name is a free one. With `line_seed` a line that can be disturbed is between rig and instrument.

    Raises ChildFailed where a part does not start, Stopped where `stop` is set first.
    """
    own = {name: dict(table) for name, table in (tables or {}).items()}
    can = {"enabled": True, "interface": "socketcand", **own.get("can", {})}
    modbus = {"port": held_port(children), **own.get("modbus", {})}
    sim = children.enter_context(Child("simulator", ["instrument", "sim", "--link", str(link), *rig]))
    hub = children.enter_context(Child("CAN hub", ["registers.can.hub", "--port", str(can.get("port", 0))]))
    ends_later = children.enter_context(ExitStack())
    host = children.enter_context(Child("instrument", ["instrument", "run", "--config", "/dev/stdin"]))
    can["port"] = hub.ready(stop)["port"]
    control_port = sim.ready(stop)["control"]
    line = None if line_seed is None else ends_later.enter_context(SerialProxy(str(link), seed=line_seed))
    at = {**own.get("rig", {}), "port": line.port if line else str(link)}
    events = {"file": str(link.with_name("events.sqlite")), **own.get("events", {})}
    local = {"socket": str(link.with_name("pneuforce.sock")), **own.get("local", {})}
    host.tell(toml({**own, "rig": at, "modbus": modbus, "can": can, "events": events, "local": local}))
    host.ready(stop)  # not before: another instrument may answer on that port
    return Stack(sim, hub, host, modbus["port"], can["port"], control_port, line)


def toml(tables: Tables) -> str:
    """Tables as TOML; what stands in them is written alike in JSON."""
    lines = []
    for name, table in tables.items():
        lines += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def held_port(until: ExitStack) -> int:
    """A TCP port of the loopback that nobody is given by chance until `until` ends, and a server may take."""
    held = until.enter_context(socket.socket())
    held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as a server does: so both may have it
    held.bind(("127.0.0.1", 0))
    port: int = held.getsockname()[1]
    return port


def free_port() -> int:
    """A TCP port of the loopback that is free now."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
        return port
