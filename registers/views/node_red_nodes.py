"""Nodes of a Node-RED flow as the editor exports them: function nodes, Modbus nodes, links and buttons."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

Node = dict[str, Any]
Point = tuple[int, int]  #: position on a tab [px]
Wires = Sequence[Sequence[str]]  #: for each output, the names of the nodes that receive its messages

JAVASCRIPT = Path(__file__).with_name("javascript")
#: Configuration node with the connection. Only its host, port and unit id depend on the installation.
CLIENT = "pneuforce instrument"
_CONNECTION: Node = {
    "clienttype": "tcp",
    "tcpType": "DEFAULT",
    "tcpHost": "127.0.0.1",
    "tcpPort": "5020",
    "unit_id": 1,
    "bufferCommands": True,
    "parallelUnitIdsAllowed": True,
    "commandDelay": 1,
    "clientTimeout": 1000,
    "reconnectOnTimeout": True,
    "reconnectTimeout": 1000,
}
_CLIENT_LOGS = (
    "stateLogEnabled",
    "queueLogEnabled",
    "failureLogEnabled",
    "showErrors",
    "showWarnings",
    "showLogs",
)
#: With these settings, a Modbus node also sends a message if its request has failed.
_REQUEST: Node = {
    "emptyMsgOnFail": True,
    "keepMsgProperties": True,
    "showStatusActivities": False,
    "showErrors": False,
    "showWarnings": False,
    "delayOnStart": False,
    "startDelayTime": "",
}
_NO_IO_FILE: Node = {"useIOFile": False, "ioFile": "", "useIOForPayload": False, "logIOActivities": False}


def render_nodes(nodes: list[Node]) -> str:
    """Return nodes as the JSON text that the Node-RED editor imports."""
    return json.dumps(nodes, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def node_id(name: str) -> str:
    """Return the identifier of a node, which is always the same for the same name."""
    return hashlib.sha256(f"pneuforce/{name}".encode()).hexdigest()[:16]


def tab(name: str, help_text: str) -> Node:
    """Return a tab with a help text."""
    return {"id": node_id(name), "type": "tab", "label": name, "disabled": False, "info": help_text}


def configuration(kind: str, name: str, **settings: Any) -> Node:
    """Return a configuration node, which is on no tab. Its identifier is that of its type and name."""
    return {"id": node_id(f"{kind} {name}"), "type": kind, "name": name, **settings}


def placed(kind: str, name: str, at: Point, wires: Wires, on: str, **settings: Any) -> Node:
    """Return a node at the position `at` of the tab `on`."""
    place = {"id": node_id(name), "type": kind, "z": node_id(on), "name": name, "x": at[0], "y": at[1]}
    return {**place, **settings, "wires": [[node_id(target) for target in output] for output in wires]}


def function(name: str, at: Point, wires: Wires, on: str, tables: Node, state: Node) -> Node:
    """Return a function node with the code of its file, and with its tables and its first state."""
    start = "".join(
        f'context.set("{key}", {json.dumps(value, indent=2, ensure_ascii=False)});\n'
        for key, value in (("tables", tables), ("state", state))
    )
    code = (JAVASCRIPT / f"{name.lower()}.js").read_text(encoding="utf-8")
    settings: Node = {"outputs": len(wires), "timeout": 0, "noerr": 0, "finalize": "", "libs": []}
    return placed("function", name, at, wires, on, func=code, initialize=start, **settings)


def link_in(name: str, at: Point, others: Sequence[str], targets: Sequence[str], on: str) -> Node:
    """Return a node that receives the messages of link nodes on other tabs."""
    return placed("link in", name, at, (targets,), on, links=[node_id(other) for other in others])


def link_out(name: str, at: Point, others: Sequence[str], on: str) -> Node:
    """Return a node that sends messages to link nodes on other tabs."""
    return placed("link out", name, at, (), on, mode="link", links=[node_id(other) for other in others])


def client() -> Node:
    """Return the configuration node with the connection to the instrument."""
    return configuration("modbus-client", CLIENT, **_CONNECTION, **dict.fromkeys(_CLIENT_LOGS, False))


def modbus(kind: str, name: str, at: Point, target: str, on: str) -> Node:
    """Return a Modbus node that sends its answers, and a message for each failure, to a node."""
    extra = _NO_IO_FILE if kind == "modbus-flex-getter" else {}
    server = node_id(f"modbus-client {CLIENT}")
    return placed(kind, name, at, ((target,), ()), on, server=server, **_REQUEST, **extra)


def inject(
    name: str, topic: str, at: Point, targets: Sequence[str], on: str, value: int | None = None, **repeat: Any
) -> Node:
    """Return a button that sends a message with a topic and, if given, a number."""
    properties = [{"p": "topic", "vt": "str"}]
    if value is not None:
        properties.append({"p": "payload", "v": str(value), "vt": "num"})
    settings: Node = {"repeat": "", "crontab": "", "once": False, "onceDelay": 0.1, **repeat}
    return placed("inject", name, at, (targets,), on, props=properties, topic=topic, **settings)


def debug(name: str, at: Point, on: str, active: bool) -> Node:
    """Return a node that shows payloads in the debug sidebar of the editor."""
    settings: Node = {"tosidebar": True, "console": False, "tostatus": False, "complete": "payload"}
    return placed("debug", name, at, (), on, active=active, targetType="msg", **settings)
