"""Connection of one client to the CAN hub: the handshake, then frames."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from pneuforce.registers.can.socketcand import (
    ECHO,
    GREETING,
    NO_SUCH_BUS,
    OK,
    TOO_MANY_CLIENTS,
    SocketcandDecoder,
    frame_message,
)

CHANNEL = "can0"
HANDSHAKE_TIMEOUT_S = 5.0  #: a client that has not completed the handshake by then is disconnected
#: Delay of the first frame after the handshake: python-can's handshake fails if a frame arrives together with
#: the last "ok".
FIRST_FRAME_DELAY_S = 0.1
#: A client with more unread bytes, about 20 000 frames, is disconnected.
MAX_UNREAD_BYTES = 1 << 20


@dataclass(slots=True)
class HubCounters:
    """Counters of a hub since its creation."""

    connections: int = 0
    frames: int = 0  #: frames forwarded
    garbage: int = 0  #: malformed messages, and messages that are invalid in the client's state
    rejected_clients: int = 0  #: clients rejected because too many were connected
    disconnected: int = 0  #: clients disconnected because of unread data or a late or wrong handshake
    late: int = 0  #: frames dropped because the hub process had been suspended


class ClientRegistry(Protocol):
    """Interface of the hub for its clients."""

    counters: HubCounters
    #: Clients that have completed the handshake.
    members: set[HubClient]
    #: Returns the time [s since 1970].
    clock: Callable[[], float]

    def add(self, client: HubClient) -> bool:
        """Add a connected client; return False if the hub is full."""
        ...

    def remove(self, client: HubClient) -> None:
        """Remove a client that has disconnected."""
        ...

    def forward(self, frames: list[bytes], sender: HubClient) -> None:
        """Send `frames` to all clients in `members` except `sender`."""
        ...


class HubClient(asyncio.Protocol):
    """One client, from its connection to its disconnection."""

    def __init__(self, hub: ClientRegistry) -> None:
        self._hub = hub
        self._timer: asyncio.TimerHandle | None = None
        self._decoder = SocketcandDecoder()
        self._opened = False
        #: Frames of other clients that wait for the end of this client's handshake; None after it.
        self._pending: bytearray | None = bytearray()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Send the greeting, or reject the client if the hub is full."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if not self._hub.add(self):
            transport.write(TOO_MANY_CLIENTS)
            transport.close()
            return
        transport.write(GREETING)
        self._timer = asyncio.get_running_loop().call_later(HANDSHAKE_TIMEOUT_S, self._disconnect)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """Remove the client from the hub, and cancel its timer, which would keep this object alive."""
        if self._timer is not None:
            self._timer.cancel()
        self._hub.remove(self)

    def data_received(self, data: bytes) -> None:
        """Answer handshake messages, and forward all frames in `data` with one call."""
        garbage_before = self._decoder.garbage
        messages = self._decoder.feed(data)
        garbage = self._decoder.garbage - garbage_before
        self._hub.counters.garbage += garbage
        if garbage and self not in self._hub.members:
            self._disconnect()
            return
        frames = []
        for words in messages:
            if self._transport.is_closing():
                break
            if self not in self._hub.members:
                self._answer_handshake(words)
            elif words == ["echo"]:
                self._write(ECHO)
            elif frame := frame_message(words, self._hub.clock()):
                frames.append(frame)
            else:
                self._hub.counters.garbage += 1
        if frames:
            self._send_pending()  # a client that sends frames has already read its last "ok"
            self._hub.forward(frames, self)

    def _answer_handshake(self, words: list[str]) -> None:
        """Answer `open` and `rawmode`. Disconnect after any other message.

        A web page in a browser can send text to the hub, but the first bytes are always a request of HTTP.
        """
        if words == ["open", CHANNEL]:
            self._opened = True
            self._write(OK)
        elif words[:1] == ["open"]:
            self._write(NO_SUCH_BUS)
        elif words == ["rawmode"] and self._opened:
            self._write(OK)
            self._hub.members.add(self)
            if self._timer is not None:
                self._timer.cancel()
            self._timer = asyncio.get_running_loop().call_later(FIRST_FRAME_DELAY_S, self._send_pending)
        else:
            self._hub.counters.garbage += 1
            self._disconnect()

    def _send_pending(self) -> None:
        """Send the pending frames; from now on, `send_frames` sends at once."""
        pending, self._pending = self._pending, None
        if pending:
            self._write(bytes(pending))

    def send_frames(self, data: bytes) -> None:
        """Send frames to this client, or store them until its handshake is complete."""
        if self._pending is not None:
            self._pending += data
            self._limit_unread(len(self._pending))
        else:
            self._write(data)

    def _write(self, data: bytes) -> None:
        if not self._transport.is_closing():
            self._transport.write(data)
            self._limit_unread(self._transport.get_write_buffer_size())

    def _limit_unread(self, unread_bytes: int) -> None:
        """Disconnect a client that does not read."""
        if unread_bytes > MAX_UNREAD_BYTES:
            self._disconnect()

    def _disconnect(self) -> None:
        self._hub.counters.disconnected += 1
        self._hub.members.discard(self)
        self.abort()

    def abort(self) -> None:
        """Close the connection at once and discard unsent data."""
        self._transport.abort()
