"""Transport with TLS on top of a TCP transport.

asyncio's own TLS starts the protocol of a connection only after the handshake. The limiter could then neither
count nor close connections without a complete handshake. With this transport, the protocol starts when the
TCP connection is accepted, and a failed handshake sends its alert, which asyncio does not send.
"""

from __future__ import annotations

import asyncio
import ssl
from contextlib import suppress
from typing import Any

READ_BYTES = 65_536


class TlsTransport(asyncio.Transport):
    """Server side of one connection. Bytes pass unchanged until `begin` is called."""

    def __init__(self, transport: asyncio.Transport) -> None:
        super().__init__()
        self.is_secure = False  #: the handshake is complete
        self.is_ended = False  #: the client has announced that no more bytes follow
        self._transport = transport
        self._incoming, self._outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tls: ssl.SSLObject | None = None

    def begin(self, context: ssl.SSLContext) -> None:
        """Expect a handshake of the client in the bytes that are received from now on."""
        self._tls = context.wrap_bio(self._incoming, self._outgoing, server_side=True)

    def receive(self, data: bytes) -> bytes:
        """Return the decrypted bytes of received bytes, empty during the handshake.

        Raises ssl.SSLError after the alert has been sent.
        """
        if self._tls is None:
            return data
        self._incoming.write(data)
        try:
            return self._decrypt(self._tls)
        finally:
            self._send()

    def _decrypt(self, tls: ssl.SSLObject) -> bytes:
        decrypted = bytearray()
        with suppress(ssl.SSLWantReadError):
            if not self.is_secure:
                tls.do_handshake()
                self.is_secure = True
            while chunk := tls.read(READ_BYTES):
                decrypted += chunk
            self.is_ended = True
        return bytes(decrypted)

    def _send(self) -> None:
        if self._outgoing.pending:
            self._transport.write(self._outgoing.read())

    def write(self, data: bytes | bytearray | memoryview) -> None:
        """Send bytes, encrypted if TLS has begun."""
        if self._tls is None:
            self._transport.write(data)
        elif not self.is_closing():
            remaining = memoryview(data)
            while remaining:
                remaining = remaining[self._tls.write(remaining) :]
            self._send()

    def close(self) -> None:
        """Announce the end to the client, then close the connection when all bytes are sent."""
        if self._tls is not None and not self.is_closing():
            with suppress(ssl.SSLError):  # the answer of the client is not awaited
                self._tls.unwrap()
            self._send()
        self._transport.close()

    # ---- the same for both

    def abort(self) -> None:
        """Close the connection at once."""
        self._transport.abort()

    def is_closing(self) -> bool:
        """Return True if the connection is closed or closing."""
        return self._transport.is_closing()

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        """Return information about the TCP connection."""
        return self._transport.get_extra_info(name, default)

    def pause_reading(self) -> None:
        """Stop receiving."""
        self._transport.pause_reading()

    def resume_reading(self) -> None:
        """Receive again."""
        self._transport.resume_reading()

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        """Set the number of unsent bytes at which the protocol must pause."""
        self._transport.set_write_buffer_limits(high, low)
