"""A server on a free port of this machine, and raw bytes to and from it."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from registers.modbus.identity import Object
from registers.modbus.tcp import ModbusTcpServer, Options
from registers.source import Source

FORCE = bytes.fromhex("04 0000 0002")
FORCE_ANSWER = bytes.fromhex("04 04 3fa00000")
IDENTITY = {Object.VENDOR: "pneuforce", Object.PRODUCT_CODE: "PF", Object.REVISION: "0.1", 0x80: "42"}


@contextmanager
def serving(source: Source, **options: Any) -> Iterator[ModbusTcpServer]:
    """A server in a thread of its own, until the block ends."""
    server = ModbusTcpServer(source, Options(**{"port": 0} | options), IDENTITY)
    loop = asyncio.new_event_loop()
    loop.run_until_complete(server.start())
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    try:
        yield server
    finally:
        loop.call_soon_threadsafe(server.close)
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.run_until_complete(asyncio.sleep(0))
        loop.close()


def connected(server: ModbusTcpServer, address: str = "127.0.0.1") -> socket.socket:
    """A client at an address of the loopback."""
    return socket.create_connection(("127.0.0.1", server.port), timeout=10, source_address=(address, 0))


def asked(client: socket.socket, request: str) -> str:
    """Hex of the one answer to a request in hex; "" where the server closed."""
    client.sendall(bytes.fromhex(request))
    return received(client)


def still_answers(client):
    return asked(client, "0001 0000 0006 01 04 0000 0002") == "00 01 00 00 00 07 01 04 04 3f a0 00 00"


def received(client: socket.socket) -> str:
    head = exactly(client, 6)
    return (head + exactly(client, int.from_bytes(head[4:6], "big"))).hex(" ") if head else ""


def everything(client: socket.socket) -> bytes:
    """All bytes until the server closes."""
    data = b""
    while chunk := client.recv(65536):
        data += chunk
    return data


def exactly(client: socket.socket, count: int) -> bytes:
    """`count` bytes; none where the server closed first."""
    data = bytearray()
    while len(data) < count:
        chunk = client.recv(min(count - len(data), 65536))
        if not chunk:
            return b""
        data += chunk
    return bytes(data)


def eventually(fact: Callable[[], bool], within_s: float = 15.0) -> bool:
    deadline = time.monotonic() + within_s
    while not fact():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.005)
    return True
