"""Modbus TCP server on a free port of this machine, and a raw client."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from pneuforce.registers.modbus.device_identification import IdentityObject
from pneuforce.registers.modbus.tcp import ModbusTcpOptions, ModbusTcpServer
from pneuforce.registers.source import Source

FORCE = bytes.fromhex("04 0000 0002")
FORCE_ANSWER = bytes.fromhex("04 04 3fa00000")
IDENTITY = {
    IdentityObject.VENDOR: "pneuforce",
    IdentityObject.PRODUCT_CODE: "PF",
    IdentityObject.REVISION: "0.1",
    0x80: "42",
}


@contextmanager
def serving(source: Source, **options: Any) -> Iterator[ModbusTcpServer]:
    """Run a server in a separate thread until the block ends."""
    server = ModbusTcpServer(source, ModbusTcpOptions(**{"port": 0} | options), IDENTITY)
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
    """Return a client socket that connects from `address`, a loopback address."""
    return socket.create_connection(("127.0.0.1", server.port), timeout=10, source_address=(address, 0))


def send_request(client: socket.socket, request: str) -> str:
    """Send a hex text. Return the answer as hex text, or "" if the server closes the connection."""
    client.sendall(bytes.fromhex(request))
    return read_answer(client)


def still_answers(client):
    return send_request(client, "0001 0000 0006 01 04 0000 0002") == "00 01 00 00 00 07 01 04 04 3f a0 00 00"


def read_answer(client: socket.socket) -> str:
    head = read_exactly(client, 6)
    return (head + read_exactly(client, int.from_bytes(head[4:6], "big"))).hex(" ") if head else ""


def read_until_closed(client: socket.socket) -> bytes:
    """Return all bytes until the server closes the connection."""
    data = b""
    while chunk := client.recv(65536):
        data += chunk
    return data


def read_exactly(client: socket.socket, count: int) -> bytes:
    """Return `count` bytes, or b"" if the server closes the connection first."""
    data = bytearray()
    while len(data) < count:
        chunk = client.recv(min(count - len(data), 65536))
        if not chunk:
            return b""
        data += chunk
    return bytes(data)


def eventually(condition: Callable[[], bool], within_s: float = 15.0) -> bool:
    """Wait until `condition()` is true. Return False if the condition is still false after `within_s`."""
    deadline = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.005)
    return True
