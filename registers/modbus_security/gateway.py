"""TLS gateway: verifies the certificates of clients, and copies their Modbus bytes to the instrument.

The gateway runs in its own process, so that handshakes delay neither the board nor other buses.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import ssl
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from pneuforce.registers.modbus_security.certificate import ClientIdentity, identity_of
from pneuforce.registers.modbus_security.forwarded import ForwardedClient
from pneuforce.registers.modbus_security.pending_handshakes import PendingHandshakes
from pneuforce.registers.modbus_security.tls_stream import CHUNK_BYTES, TlsStream
from pneuforce.support.allow_list import AllowList
from pneuforce.support.renewed_context import RELOAD_PERIOD_S, RenewedContext
from pneuforce.support.tls_failure import tls_failure_reason
from pneuforce.support.tls_files import TlsFiles

log = logging.getLogger("pneuforce")

HANDSHAKE_TIMEOUT_S = 5.0
CHECK_PERIOD_S = 1.0  #: period of the checks for expired certificates
MAX_FAILURES = 64  #: different pairs of address and reason that wait for their report
READ_TIMEOUT_S = 10.0  #: time in which the receiver must read
ACCEPT_ERROR_WAIT_S = 0.1


@dataclass(slots=True)
class GatewayCounters:
    """Event counters of the gateway since its start."""

    handshakes: int = 0  #: completed handshakes
    failed: Counter[str] = field(default_factory=Counter)  #: failed handshakes by reason
    not_allowed: int = 0  #: connections closed because of their address


@dataclass(eq=False, slots=True)
class _Client:
    identity: ClientIdentity
    stream: TlsStream


class Gateway:
    """Gateway for one instrument. `failures` counts failed handshakes by address and reason."""

    def __init__(self, files: TlsFiles, instrument: Path, allow: list[str]) -> None:
        """Create a gateway to the Unix socket `instrument`.

        Raises OSError, including ssl.SSLError, if the files cannot be used, and ValueError if an item of
        `allow` is neither an address nor a network.
        """
        self.counters = GatewayCounters()
        self.failures: Counter[tuple[str, str]] = Counter()
        self.tls = RenewedContext(files, "Modbus/TCP Security")
        self._instrument = instrument
        self._allow_list = AllowList(allow)
        self._pending = PendingHandshakes()
        self._clients: set[_Client] = set()
        self._tasks: set[asyncio.Task[None]] = set()

    async def run(self, listener: socket.socket) -> None:
        """Serve until the task is cancelled."""
        loop = asyncio.get_running_loop()
        listener.setblocking(False)
        maintaining = loop.create_task(self._maintain())
        try:
            while True:
                try:
                    connection, peer = await loop.sock_accept(listener)
                except OSError:  # no free descriptor, or the client has reset the connection
                    await asyncio.sleep(ACCEPT_ERROR_WAIT_S)
                    continue
                self._begin(connection, str(peer[0]))
        finally:
            maintaining.cancel()
            for task in self._tasks:
                task.cancel()
            listener.close()

    def _begin(self, connection: socket.socket, address: str) -> None:
        if not self._allow_list.admits(address):
            self.counters.not_allowed += 1
            connection.close()
            return
        connection.setblocking(False)
        task = asyncio.get_running_loop().create_task(self._serve(connection, address))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _serve(self, connection: socket.socket, address: str) -> None:
        """Complete the handshake of one client, then copy bytes until one side closes."""
        reader, writer = await asyncio.open_connection(sock=connection, limit=CHUNK_BYTES)
        stream = TlsStream(self.tls.current, reader, writer)
        try:
            identity = await self._handshake(stream, address)
            if identity is None:
                return
            client = _Client(identity, stream)
            self._clients.add(client)
            try:
                await self._forward(client, address)
            finally:
                self._clients.discard(client)
        finally:
            writer.close()

    async def _handshake(self, stream: TlsStream, address: str) -> ClientIdentity | None:
        """Return the identity of the client, or None after a failed handshake, which is counted."""
        task = asyncio.current_task()
        assert task is not None
        self._pending.add(task, address)
        try:
            async with asyncio.timeout(HANDSHAKE_TIMEOUT_S):
                identity = identity_of(await stream.handshake())
            if identity.valid_until_s < time.time():  # TLS does not verify it again in a resumed session
                raise ValueError("certificate has expired")
        except (OSError, ValueError) as error:
            self._count_failure(address, failure_reason(error))
            return None
        except asyncio.CancelledError:
            self._count_failure(address, "too many handshakes")
            raise
        finally:
            self._pending.remove(task)
        self.counters.handshakes += 1
        return identity

    async def _forward(self, client: _Client, address: str) -> None:
        """Copy bytes between a client and the instrument until one of them closes the connection."""
        name, role, _ = client.identity
        try:
            from_instrument, to_instrument = await asyncio.open_unix_connection(self._instrument)
        except OSError:
            return
        to_instrument.write(ForwardedClient(address, name, role).encode())
        directions = (
            _copy_requests(client.stream, to_instrument),
            _copy_answers(from_instrument, client.stream),
        )
        tasks = [asyncio.create_task(direction) for direction in directions]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            to_instrument.close()
            client.stream.close()

    async def _maintain(self) -> None:
        """Close connections whose certificate has expired. Read the files again after a change."""
        next_reload_s = 0.0
        while True:
            now_s = time.time()
            for client in [each for each in self._clients if now_s > each.identity.valid_until_s]:
                log.warning("Modbus/TCP Security: the certificate of %s has expired", client.identity.name)
                client.stream.abort()
            if time.monotonic() >= next_reload_s:
                next_reload_s = time.monotonic() + RELOAD_PERIOD_S
                self._reload()
            await asyncio.sleep(CHECK_PERIOD_S)

    def _reload(self) -> None:
        """Read changed files. After a change of the CA or the CRL, every client must connect again."""
        if self.tls.renew(time.time()) & {"ca", "crl"}:
            for client in self._clients:
                client.stream.abort()

    def _count_failure(self, address: str, reason: str) -> None:
        self.counters.failed[reason] += 1
        if (address, reason) in self.failures or len(self.failures) < MAX_FAILURES:
            self.failures[address, reason] += 1


async def _copy_requests(stream: TlsStream, writer: asyncio.StreamWriter) -> None:
    with suppress(OSError):
        while chunk := await stream.read():
            writer.write(chunk)
            await writer.drain()


async def _copy_answers(reader: asyncio.StreamReader, stream: TlsStream) -> None:
    """Copy until the end of input, an error, or a client that does not read for READ_TIMEOUT_S."""
    with suppress(OSError):
        while chunk := await reader.read(CHUNK_BYTES):
            async with asyncio.timeout(READ_TIMEOUT_S):
                await stream.write(chunk)


def failure_reason(error: Exception) -> str:
    """Return why a handshake failed, in a few words: a text of OpenSSL or of this module."""
    if isinstance(error, TimeoutError):
        return "handshake timeout"
    if isinstance(error, ssl.SSLError):
        return tls_failure_reason(error)
    return "connection closed by the client" if isinstance(error, OSError) else str(error)
