"""The control server: JSON lines over TCP, for the truth and for orders. No rig has such a thing."""

from __future__ import annotations

import json
import socket
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from sim.faults import Refused
from sim.orders import ORDERS, is_number, obey
from sim.world import World

MOST_CLIENTS = 16
LONGEST_LINE_BYTES = 4096
#: Taken from a client per sample, so that a talkative one does not delay the rig.
READ_BYTES = 512
#: A client that leaves more than this unread is dropped.
MOST_UNREAD_BYTES = 262_144
RAREST_TRUTH = 100_000


@dataclass(slots=True)
class Client:
    """One connection."""

    connection: socket.socket
    truth_every: int = 0  #: one line per this many samples; 0 for none
    unread: bytearray = field(default_factory=bytearray)
    unsent: bytearray = field(default_factory=bytearray)


class Control:
    """Listens on the loopback. It never waits for a client."""

    def __init__(self, port: int, world: World) -> None:
        """Listen on `port`, 0 for a free one. Raises OSError where it is taken."""
        self._world = world
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._clients: dict[int, Client] = {}
        self._last_sample = 0

    def filenos(self) -> list[int]:
        """Descriptors that become readable when a client has come or written."""
        return [self._listener.fileno(), *self._clients]

    def serve(self, readable: list[int]) -> None:
        """Take in what has come on these descriptors."""
        for fileno in readable:
            if fileno == self._listener.fileno():
                self._accept()
            elif fileno in self._clients:
                self._read(self._clients[fileno])

    def publish(self) -> None:
        """Send the truth to whoever wants this sample."""
        truth = self._world.rig.truth
        if truth.sample == self._last_sample:
            return
        self._last_sample = truth.sample
        line = b""
        for client in list(self._clients.values()):
            if client.truth_every and truth.sample % client.truth_every == 0:
                told = {**truth._asdict(), "setpoint_kpa": self._world.rig.hand.setpoint_kpa}
                line = line or json.dumps(told).encode() + b"\n"
                self._send(client, line)

    def close(self) -> None:
        """End all connections."""
        for client in list(self._clients.values()):
            self._drop(client)
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):
            connection, _ = self._listener.accept()
            if len(self._clients) >= MOST_CLIENTS:
                connection.close()
                return
            connection.setblocking(False)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MOST_UNREAD_BYTES)
            self._clients[connection.fileno()] = Client(connection)

    def _read(self, client: Client) -> None:
        try:
            data = client.connection.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        *lines, rest = bytes(client.unread + data).split(b"\n")
        client.unread = bytearray(rest)
        for line in filter(bytes.strip, lines):
            self._answer(client, line)
        if len(rest) > LONGEST_LINE_BYTES:
            self._drop(client)

    def _answer(self, client: Client, line: bytes) -> None:
        try:
            self._obey(client, json.loads(line))
        except (ValueError, RecursionError) as error:
            sentence = str(error) if isinstance(error, Refused) else "not a line of JSON"
            self._send(client, json.dumps({"error": sentence}).encode() + b"\n")

    def _obey(self, client: Client, request: Any) -> None:
        """Carry out one request. Raises Refused before anything of it is done."""
        keys = ", ".join(("truth", *ORDERS))
        if not isinstance(request, dict) or len(request) != 1:
            raise Refused(f"one object with one of the keys {keys} is expected")
        [(key, value)] = request.items()
        if key == "truth":
            client.truth_every = _truth_every(value)
            return
        if key not in ORDERS:
            raise Refused(f"there is no key {key!r}, only {keys}")
        answer = obey(self._world, key, value)
        if answer is not None:
            self._send(client, json.dumps(answer).encode() + b"\n")

    def _send(self, client: Client, line: bytes) -> None:
        client.unsent += line
        try:
            sent = client.connection.send(client.unsent)
            del client.unsent[:sent]
        except BlockingIOError:
            pass
        except OSError:
            self._drop(client)
            return
        if len(client.unsent) > MOST_UNREAD_BYTES:
            self._drop(client)

    def _drop(self, client: Client) -> None:
        self._clients.pop(client.connection.fileno(), None)
        client.connection.close()


def _truth_every(value: Any) -> int:
    if not (is_number(value) and isinstance(value, int) and 0 <= value <= RAREST_TRUTH):
        raise Refused(f"truth expects a whole number of samples from 0 to {RAREST_TRUTH}")
    return value
