"""Mosquitto, a host application, and the MQTT process of a fake instrument, for tests in real time."""

import contextlib
import getpass
import json
import os
import queue
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

from pneuforce.teststand.stack import free_port
from tests.peers.clients.client import MODULES, NODE
from tests.web.entries import header, real_snapshot
from tests.web.entries import snapshot as snapshot_entry
from tests.web.serving import FakeInstrument

TIMEOUT_S = 30.0
SNAPSHOT_S = 0.05


def eventually(condition, timeout_s=TIMEOUT_S):
    """Return the first true result of `condition`. Raise AssertionError after `timeout_s`."""
    until_s = time.monotonic() + timeout_s
    while time.monotonic() < until_s:
        if result := condition():
            return result
        time.sleep(0.02)
    raise AssertionError("the condition was not met in time")


class Broker:
    """Mosquitto on a port of its own."""

    def __init__(self, folder, *lines):
        self.port = free_port()
        self._file = Path(folder) / "mosquitto.conf"
        first = (f"listener {self.port} 127.0.0.1", f"user {getpass.getuser()}", "log_type none")
        self._file.write_text("\n".join([*first, *lines, ""]))
        self.start()

    def start(self):
        program = "/usr/sbin/mosquitto"
        self._process = subprocess.Popen([program, "-c", str(self._file)], stderr=subprocess.DEVNULL)
        eventually(lambda: socket.socket().connect_ex(("127.0.0.1", self.port)) == 0)

    @property
    def pid(self):
        return self._process.pid

    def kill(self):
        self._process.kill()
        self._process.wait()


class HostApplication:
    """Host application that uses libraries of other projects."""

    def __init__(self, port):
        self._process = subprocess.Popen(
            [NODE, str(Path(__file__).with_name("host_application.js")), str(port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"NODE_PATH": str(MODULES)},
        )
        self._lines = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()
        self.messages = []
        self.next("connected")

    def _read(self):
        for line in self._process.stdout:
            self._lines.put(json.loads(line))

    def next(self, kind, node=None, condition=lambda message: True, timeout_s=TIMEOUT_S):
        """Return the next message of a kind from an edge node for which `condition` is true."""
        until_s = time.monotonic() + timeout_s
        while True:
            message = self._lines.get(timeout=max(0.01, until_s - time.monotonic()))
            self.messages.append(message)
            if message["kind"] == kind and node in (None, message.get("node")) and condition(message):
                return message

    def publish(self, topic, **content):
        self._process.stdin.write(json.dumps({"topic": topic, **content}) + "\n")
        self._process.stdin.flush()

    def close(self):
        self._process.kill()
        self._process.wait()
        self._process.stdin.close()
        self._process.stdout.close()


def values_in(message):
    return {metric["name"]: metric["value"] for metric in message["metrics"]}


class FedInstrument(FakeInstrument):
    """Instrument that sends 20 snapshots per second. Each has a new number of contacts."""

    def __init__(self, path):
        self.changes, self.number, self.running = {}, 0, True
        self._snapshot = real_snapshot()[1]
        super().__init__(path)
        self._feeder = threading.Thread(target=self._feed, daemon=True)
        self._feeder.start()

    def _feed(self):
        greeted = None
        while self.running:
            time.sleep(SNAPSHOT_S)
            if not self.clients or not self.subscriptions:
                continue
            if greeted is not self.clients[-1]:
                greeted = self.clients[-1]
                self._try(header(time.monotonic()))
            self.number += 1
            values = self._snapshot | {"contact_counter": self.number} | self.changes
            self._try(snapshot_entry(time.monotonic(), **values))

    def _try(self, entry):
        with contextlib.suppress(OSError):
            self.send(entry)

    def close(self):
        self.running = False
        self._feeder.join()
        super().close()


class Edge:
    """MQTT process. `node` is the name of its edge node."""

    def __init__(self, socket_path, port, node, **options):
        self.node = node
        self.topic = f"spBv1.0/group/{{}}/{node}"
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "pneuforce.mqtt"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        settings = {"host": "127.0.0.1", "port": port, "tls": False, "group": "group", "device": "sensor"}
        options = {"socket": str(socket_path), **settings, "edge_node": node, **options}
        self.process.stdin.write(json.dumps(options) + "\n")
        self.process.stdin.flush()
        self.log = []
        threading.Thread(target=self._read_log, daemon=True).start()

    def _read_log(self):
        for line in self.process.stderr:
            self.log.append(line.strip())

    def logged(self, words):
        return eventually(lambda: [line for line in self.log if words in line])

    def end(self):
        self.process.stdin.close()
        return self.process.wait(60)

    def close(self):
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            with contextlib.suppress(OSError):
                stream.close()
