"""The control server: JSON lines over TCP, for the truth and for the hand. No rig has such a thing."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from sim.hand import Hand
from sim.rig import Truth
from sim.scenario import ScenarioError, contacts_of

MOST_CLIENTS = 16
LONGEST_LINE_BYTES = 4096
#: Taken from a client per sample, so that a talkative one does not delay the rig.
READ_BYTES = 512
#: A client that leaves more than this unread is dropped.
MOST_UNREAD_BYTES = 262_144
HARDEST_N = 20.0
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

    def __init__(self, port: int, hand: Hand) -> None:
        """Listen on `port`, 0 for a free one. Raises OSError where it is taken."""
        self._hand = hand
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

    def publish(self, truth: Truth) -> None:
        """Send the truth to whoever wants this sample."""
        if truth.sample == self._last_sample:
            return
        self._last_sample = truth.sample
        line = b""
        for client in list(self._clients.values()):
            if client.truth_every and truth.sample % client.truth_every == 0:
                told = {**truth._asdict(), "setpoint_kpa": self._hand.setpoint_kpa}
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
            sentence = str(error) if isinstance(error, Refused | ScenarioError) else "not a line of JSON"
            self._send(client, json.dumps({"error": sentence}).encode() + b"\n")

    def _obey(self, client: Client, request: Any) -> None:
        """Carry out one request. Raises Refused before anything of it is done."""
        if not isinstance(request, dict) or len(request) != 1:
            raise Refused(f"one object with one of the keys {', '.join(REQUESTS)} is expected")
        [(key, value)] = request.items()
        if key not in REQUESTS:
            raise Refused(f"there is no key {key!r}, only {', '.join(REQUESTS)}")
        accepts, expected = REQUESTS[key]
        if not accepts(value):
            raise Refused(f"{key} expects {expected}")
        self._carry_out(client, key, value)

    def _carry_out(self, client: Client, key: str, value: Any) -> None:
        if key == "truth":
            client.truth_every = value
        elif key == "press":
            self._hand.press(float(value))
        elif key == "release":
            self._hand.release()
        elif key == "contact":
            self._hand.play(contacts_of(value))
        else:
            self._hand.works = value

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


class Refused(ValueError):
    """A request that cannot be carried out."""


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


REQUESTS: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "truth": (
        lambda v: _is_number(v) and isinstance(v, int) and 0 <= v <= RAREST_TRUTH,
        f"a whole number of samples from 0 to {RAREST_TRUTH}",
    ),
    "press": (lambda v: _is_number(v) and 0 <= v <= HARDEST_N, f"a force from 0 to {HARDEST_N:g} N"),
    "release": (lambda v: v is True, "true"),
    "contact": (lambda v: isinstance(v, dict), "an object like a contact of a scenario"),
    "hand": (lambda v: isinstance(v, bool), "true or false"),
}
