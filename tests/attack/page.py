"""Random and unfinished HTTP requests to the web page, while an operator vents again and again."""

from __future__ import annotations

import random
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from pneuforce.teststand.stack import free_port
from tests.attack.modbus import mutated
from tests.attack.result import AttackResult
from tests.attack.target import attacked

ADDRESSES = tuple(f"127.0.0.{number}" for number in range(1, 6))
MAX_OPEN = 500  #: connections that stay open at the same time
VENT_PERIOD_S = 0.1
TIMEOUT_S = 3.0
HEAD = b"Host: 127.0.0.1\r\n"
VENT = b"POST /api/vent HTTP/1.1\r\n" + HEAD + b"Content-Length: 0\r\nConnection: close\r\n\r\n"
UNFINISHED = b"POST /api/login HTTP/1.1\r\n" + HEAD + b"Content-Length: 9\r\n\r\n{"
REQUESTS = (
    UNFINISHED,
    UNFINISHED,
    b"GET /api/live HTTP/1.1\r\n" + HEAD + b"\r\n",
    b"GET /api/registers HTTP/1.1\r\n" + HEAD + b"\r\n",
    b"GET / HTTP/1.1\r\n" + HEAD,
    b"POST /api/write HTTP/1.1\r\n" + HEAD + b"Transfer-Encoding: chunked\r\n\r\nffffffff\r\n",
    b"POST /api/write HTTP/1.1\r\n"
    + HEAD
    + b'Content-Length: 40\r\n\r\n{"values":{"mode":"hold"},"seen_s":1',
    b"POST /api/login HTTP/1.1\r\n" + HEAD + b'Content-Length: 30\r\n\r\n{"name":"anna","password":"x"}',
    b"POST /api/session HTTP/1.1\r\n"
    + HEAD
    + b"Cookie: pneuforce-session-80=x\r\nContent-Length: 2\r\n\r\n{}",
    b"GET /static/../../../etc/passwd HTTP/1.1\r\n" + HEAD + b"\r\n",
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
    b"",
)


def attack_page(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Send requests from several addresses and keep them open. Each vent must be answered with 200."""
    port = free_port()
    tables = {"web": {"enabled": True, "port": port}}
    with attacked(result, tables):
        _wait_until_served(port)
        with _Operator(port, result):
            crowd: list[socket.socket] = []
            while result.sent < amount:
                with suppress(OSError):
                    crowd.append(_connection(rng.choice(ADDRESSES), port))
                    request = rng.choice(REQUESTS)
                    crowd[-1].sendall(mutated(request, rng) if request and rng.random() < 0.5 else request)
                result.sent += 1
                if len(crowd) > MAX_OPEN:
                    crowd.pop(rng.randrange(len(crowd))).close()
            for client in crowd:
                client.close()


def _connection(address: str, port: int) -> socket.socket:
    client = socket.socket()
    client.settimeout(TIMEOUT_S)
    client.bind((address, 0))
    client.connect(("127.0.0.1", port))
    return client


def _wait_until_served(port: int) -> None:
    until_s = time.monotonic() + 20.0
    while time.monotonic() < until_s:
        with suppress(OSError):
            socket.create_connection(("127.0.0.1", port), 1.0).close()
            return
        time.sleep(0.05)


class _Operator(threading.Thread):
    """Operator who vents every 0.1 s, over a new connection each time."""

    def __init__(self, port: int, result: AttackResult) -> None:
        super().__init__(daemon=True)
        self._port, self._result = port, result
        self._ended = threading.Event()

    def __enter__(self) -> None:
        self.start()

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self.join()

    def run(self) -> None:
        """Vent until the end."""
        while not self._ended.wait(VENT_PERIOD_S):
            answer = _try(lambda: self._vent())
            self._result.notes["vents"] += 1
            self._result.check(answer.startswith("HTTP/1.1 200"), f"a vent was not accepted: {answer[:60]}")

    def _vent(self) -> str:
        with socket.create_connection(("127.0.0.1", self._port), TIMEOUT_S) as client:
            client.sendall(VENT)
            return client.recv(4096).decode("latin1")


def _try(call: Callable[[], str]) -> str:
    try:
        return call()
    except OSError as error:
        return repr(error)
