"""Control server for true states and requests, as JSON lines over TCP. A real rig has no such server.

A web page in a browser can connect to the server, but the first bytes are always a request of HTTP. A client
whose first line is not a request of this server is therefore disconnected, and nothing is executed.
"""

from __future__ import annotations

import json
import logging
import socket
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from pneuforce.sim.contacts.scenario_table import is_number
from pneuforce.sim.faults import SimulatorRequestError
from pneuforce.sim.server.control_requests import REQUESTS, execute_request
from pneuforce.sim.world import World

log = logging.getLogger("pneuforce")

MAX_CLIENTS = 16
MAX_LINE_BYTES = 4096
READ_BYTES = 512
#: Computing time for requests per sample [s]. The limit keeps the simulation in real time under any load.
REQUEST_TIME_S = 0.5e-3
#: A client with more unsent bytes than this is disconnected.
MAX_UNSENT_BYTES = 262_144
MAX_TRUTH_SAMPLES = 100_000
FIRST_BYTE = b"{"  #: a client that sends another first byte is disconnected at once


@dataclass(slots=True)
class ControlConnection:
    """Connection of one client."""

    connection: socket.socket
    truth_every: int = 0  #: the true state is sent every `truth_every` samples; 0: never
    received: bytearray = field(default_factory=bytearray)
    unsent: bytearray = field(default_factory=bytearray)
    accepted: bool = False  #: the first line was a request with a known key
    ending: bool = False  #: the client is disconnected after the last answer

    @property
    def has_request(self) -> bool:
        """Return True if at least one complete line is waiting."""
        return b"\n" in self.received

    def next_line(self) -> bytes:
        """Remove and return the first complete line."""
        line, _, self.received = self.received.partition(b"\n")
        return bytes(line)


class ControlServer:
    """Control server on the loopback interface. It never blocks on a client."""

    def __init__(self, port: int, world: World) -> None:
        """Listen on `port`; 0 selects a free port. Raises OSError if the port is in use."""
        self._world = world
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._clients: dict[int, ControlConnection] = {}
        self._last_sample = 0
        # Remaining computing time for requests. A slow request makes it negative and delays the next request.
        self._time_left_s = 0.0

    def filenos(self) -> list[int]:
        """Return the descriptors to poll for new clients and data.

        A client with a waiting request is not read until that request is executed.
        """
        return [
            self._listener.fileno(),
            *(f for f, client in self._clients.items() if not client.has_request),
        ]

    def serve(self, readable: list[int]) -> None:
        """Read from the readable descriptors, and execute requests within the time limit."""
        for fileno in readable:
            if fileno == self._listener.fileno():
                self._accept()
            elif fileno in self._clients:
                self._read(self._clients[fileno])
        self._time_left_s = min(self._time_left_s + REQUEST_TIME_S, REQUEST_TIME_S)
        self._answer_in_turn()

    def publish(self) -> None:
        """Send the answers, and the true state to all clients that have subscribed to this sample."""
        rig = self._world.rig
        sample = rig.board.samples
        subscribers = [c for c in self._clients.values() if c.truth_every and sample % c.truth_every == 0]
        if subscribers and sample != self._last_sample:
            truth = {**rig.truth._asdict(), "setpoint_kpa": rig.hand.setpoint_kpa}
            line = json.dumps(truth).encode() + b"\n"
            for client in subscribers:
                client.unsent += line
        self._last_sample = sample
        for client in [c for c in self._clients.values() if c.unsent]:
            self._send(client)

    def close(self) -> None:
        """Close all connections and the listener."""
        for client in list(self._clients.values()):
            self._disconnect(client)
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):
            connection, _ = self._listener.accept()
            if len(self._clients) >= MAX_CLIENTS:
                connection.close()
                return
            connection.setblocking(False)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MAX_UNSENT_BYTES)
            self._clients[connection.fileno()] = ControlConnection(connection)

    def _read(self, client: ControlConnection) -> None:
        try:
            data = client.connection.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        client.received += b"" if client.ending else data
        foreign = not (client.accepted or client.ending or client.received.startswith(FIRST_BYTE))
        if not data or foreign or (len(client.received) > MAX_LINE_BYTES and not client.has_request):
            self._disconnect(client)

    def _answer_in_turn(self) -> None:
        """Answer one line of each client in turn, until the computing time is used up.

        Clients that received no answer are first at the next sample.
        """
        waiting = deque((fileno, client) for fileno, client in self._clients.items() if client.has_request)
        while waiting and self._time_left_s > 0:
            start_s = time.perf_counter()
            fileno, client = waiting.popleft()
            self._answer(client, client.next_line())
            self._clients[fileno] = self._clients.pop(fileno)
            if client.has_request:
                waiting.append((fileno, client))
            self._time_left_s -= time.perf_counter() - start_s

    def _answer(self, client: ControlConnection, line: bytes) -> None:
        if not line.strip():
            return
        try:
            answer = self._execute(client, _parse(line))
        except SimulatorRequestError as error:
            answer = {"error": str(error)}
        except Exception as error:
            log.exception("internal error in a control request: %s", line.decode(errors="replace"))
            answer = {"error": f"internal error of the simulator, which continues to run: {error!r}"}
        if not client.accepted:
            client.ending = True
            client.received.clear()
        if answer is not None:
            client.unsent += json.dumps(answer).encode() + b"\n"

    def _execute(self, client: ControlConnection, request: Any) -> dict[str, Any] | None:
        """Execute one request. Return its answer, or None.

        Raises SimulatorRequestError if the request is invalid. The request then has no effect.
        """
        keys = ", ".join(("truth", *REQUESTS))
        if not isinstance(request, dict) or len(request) != 1:
            raise SimulatorRequestError(f"one object with one of the keys {keys} is expected")
        [(key, value)] = request.items()
        client.accepted = client.accepted or key == "truth" or key in REQUESTS
        if key == "truth":
            client.truth_every = _truth_every(value)
            return None
        if key not in REQUESTS:
            raise SimulatorRequestError(f"unknown key {key!r}; allowed: {keys}")
        return execute_request(self._world, key, value)

    def _send(self, client: ControlConnection) -> None:
        try:
            sent = client.connection.send(client.unsent)
            del client.unsent[:sent]
        except BlockingIOError:
            pass
        except OSError:
            self._disconnect(client)
            return
        if len(client.unsent) > MAX_UNSENT_BYTES or (client.ending and not client.unsent):
            self._disconnect(client)

    def _disconnect(self, client: ControlConnection) -> None:
        self._clients.pop(client.connection.fileno(), None)
        client.connection.close()


def _parse(line: bytes) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        raise SimulatorRequestError("the line is not valid JSON") from None


def _truth_every(value: Any) -> int:
    if not (is_number(value) and isinstance(value, int) and 0 <= value <= MAX_TRUTH_SAMPLES):
        raise SimulatorRequestError(f"truth expects a whole number of samples from 0 to {MAX_TRUTH_SAMPLES}")
    return value
