"""TLS on an asyncio stream. A failed handshake sends its alert, which asyncio's own TLS does not send."""

from __future__ import annotations

import asyncio
import ssl
from contextlib import suppress

CHUNK_BYTES = 4096


class TlsStream:
    """Server side of one TLS connection."""

    def __init__(
        self, context: ssl.SSLContext, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self.writer = writer
        self._reader = reader
        self._incoming, self._outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tls = context.wrap_bio(self._incoming, self._outgoing, server_side=True)

    async def handshake(self) -> bytes:
        """Complete the handshake. Return the verified certificate of the client (DER).

        Raises OSError, including ssl.SSLError, after the alert has been sent.
        """
        while True:
            try:
                self._tls.do_handshake()
                break
            except ssl.SSLWantReadError:
                self._send()
                await self._receive()
            except ssl.SSLError:
                self._send()  # the alert
                raise
        self._send()
        await self.writer.drain()
        certificate = self._tls.getpeercert(binary_form=True)
        assert certificate is not None  # the context requires a certificate
        return certificate

    async def read(self) -> bytes:
        """Return the next bytes, empty at the end. Raises OSError."""
        while True:
            try:
                return self._tls.read(CHUNK_BYTES)
            except ssl.SSLZeroReturnError:
                return b""
            except ssl.SSLWantReadError:
                self._send()
                await self._receive()

    async def write(self, data: bytes) -> None:
        """Send bytes. Raises OSError."""
        self._tls.write(data)
        self._send()
        await self.writer.drain()

    def close(self) -> None:
        """Tell the client that no more bytes follow, then close the connection."""
        with suppress(ssl.SSLError):  # the alert is written; the answer of the client is not awaited
            self._tls.unwrap()
        self._send()
        self.writer.close()

    def abort(self) -> None:
        """Close the connection at once."""
        self.writer.transport.abort()

    async def _receive(self) -> None:
        chunk = await self._reader.read(CHUNK_BYTES)
        if not chunk:
            raise ConnectionResetError("connection closed by the client")
        self._incoming.write(chunk)

    def _send(self) -> None:
        if self._outgoing.pending:
            self.writer.write(self._outgoing.read())
