"""The control server: JSON lines over TCP, for the truth and for orders. No rig has such a thing."""

from __future__ import annotations

import json
import logging
import socket
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from sim.contacts.table import is_number
from sim.faults import Refused
from sim.orders import ORDERS, obey
from sim.world import World

log = logging.getLogger("pneuforce")

MOST_CLIENTS = 16
LONGEST_LINE_BYTES = 4096
READ_BYTES = 512
#: For orders, per sample: whoever talks without end, and however many do, the rig keeps its time.
ORDERS_S = 0.5e-3
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

    @property
    def waits(self) -> bool:
        """Whether a whole line of it is still to be answered."""
        return b"\n" in self.unread

    def next_line(self) -> bytes:
        """The line that is to be answered next."""
        line, _, self.unread = self.unread.partition(b"\n")
        return bytes(line)


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
        self._left_s = 0.0  # for orders; what one took too long the next ones wait for

    def filenos(self) -> list[int]:
        """Descriptors that become readable when a client has come or written. Who waits is not read."""
        return [self._listener.fileno(), *(f for f, client in self._clients.items() if not client.waits)]

    def serve(self, readable: list[int]) -> None:
        """Take in what has come on these descriptors, and obey as much of it as there is time for."""
        for fileno in readable:
            if fileno == self._listener.fileno():
                self._accept()
            elif fileno in self._clients:
                self._read(self._clients[fileno])
        self._left_s = min(self._left_s + ORDERS_S, ORDERS_S)
        self._answer_in_turn()

    def publish(self) -> None:
        """Send the answers, and the truth to whoever wants this sample."""
        rig = self._world.rig
        sample = rig.board.samples
        wanting = [c for c in self._clients.values() if c.truth_every and sample % c.truth_every == 0]
        if wanting and sample != self._last_sample:
            told = {**rig.truth._asdict(), "setpoint_kpa": rig.hand.setpoint_kpa}
            line = json.dumps(told).encode() + b"\n"
            for client in wanting:
                client.unsent += line
        self._last_sample = sample
        for client in [c for c in self._clients.values() if c.unsent]:
            self._send(client)

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
        client.unread += data
        if not data or (len(client.unread) > LONGEST_LINE_BYTES and not client.waits):
            self._drop(client)

    def _answer_in_turn(self) -> None:
        """A line of each client in turn; whom the time did not suffice for comes first at the next sample."""
        waiting = deque((fileno, client) for fileno, client in self._clients.items() if client.waits)
        while waiting and self._left_s > 0:
            begin_s = time.perf_counter()
            fileno, client = waiting.popleft()
            self._answer(client, client.next_line())
            self._clients[fileno] = self._clients.pop(fileno)
            if client.waits:
                waiting.append((fileno, client))
            self._left_s -= time.perf_counter() - begin_s

    def _answer(self, client: Client, line: bytes) -> None:
        if not line.strip():
            return
        try:
            answer = self._obey(client, _request(line))
        except Refused as error:
            answer = {"error": str(error)}
        except Exception as error:
            log.exception("an order ended in an error of ours: %s", line.decode(errors="replace"))
            answer = {"error": f"an error of the simulator's own, which it has survived: {error!r}"}
        if answer is not None:
            client.unsent += json.dumps(answer).encode() + b"\n"

    def _obey(self, client: Client, request: Any) -> dict[str, Any] | None:
        """Carry out one request; its answer, if it has one. Raises Refused before anything of it is done."""
        keys = ", ".join(("truth", *ORDERS))
        if not isinstance(request, dict) or len(request) != 1:
            raise Refused(f"one object with one of the keys {keys} is expected")
        [(key, value)] = request.items()
        if key == "truth":
            client.truth_every = _truth_every(value)
            return None
        if key not in ORDERS:
            raise Refused(f"there is no key {key!r}, only {keys}")
        return obey(self._world, key, value)

    def _send(self, client: Client) -> None:
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


def _request(line: bytes) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        raise Refused("not a line of JSON") from None


def _truth_every(value: Any) -> int:
    if not (is_number(value) and isinstance(value, int) and 0 <= value <= RAREST_TRUTH):
        raise Refused(f"truth expects a whole number of samples from 0 to {RAREST_TRUTH}")
    return value
