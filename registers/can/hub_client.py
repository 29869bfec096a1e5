"""One connection to the hub: first its handshake, then frames."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from registers.can.socketcand import ECHO, GREETING, NO_ROOM, NO_SUCH_BUS, OK, Decoder, frame_of_send

if TYPE_CHECKING:
    from registers.can.hub import Hub

CHANNEL = "can0"
HANDSHAKE_S = 5.0  #: after which a client that has not joined is closed
#: python-can's handshake takes a frame that comes glued to the last "ok" for a failure.
JOIN_AFTER_S = 0.1
#: Unread bytes, some 20 000 frames, at which a client is taken for dead.
MOST_UNREAD_BYTES = 1 << 20


class HubClient(asyncio.Protocol):
    """A client, from its connection to its end."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._timer: asyncio.TimerHandle | None = None
        self._decoder = Decoder()
        self._opened = False
        self._held: bytearray | None = bytearray()  #: what the others sent until this client has joined

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Greet it, or send it away where the hub is full."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if not self._hub.came(self):
            transport.write(NO_ROOM)
            transport.close()
            return
        transport.write(GREETING)
        self._timer = asyncio.get_running_loop().call_later(HANDSHAKE_S, self._give_up)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """Forget it at once; its timer would keep it."""
        if self._timer is not None:
            self._timer.cancel()
        self._hub.went(self)

    def data_received(self, data: bytes) -> None:
        """Answer the handshake; pass frames on, those that came together together."""
        garbage_before = self._decoder.garbage
        frames = []
        for words in self._decoder.feed(data):
            if self not in self._hub.members:
                self._shake_hands(words)
            elif words == ["echo"]:
                self._write(ECHO)
            elif frame := frame_of_send(words, self._hub.clock()):
                frames.append(frame)
            else:
                self._hub.counters.garbage += 1
        self._hub.counters.garbage += self._decoder.garbage - garbage_before
        if frames:
            self._join()  # who sends has read its last "ok"
            self._hub.pass_on(frames, self)

    def _shake_hands(self, words: list[str]) -> None:
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
            self._timer = asyncio.get_running_loop().call_later(JOIN_AFTER_S, self._join)
        else:
            self._hub.counters.garbage += 1

    def _join(self) -> None:
        """Hand over what was held back, and from now on everything at once."""
        held, self._held = self._held, None
        if held:
            self._write(bytes(held))

    def give(self, data: bytes) -> None:
        """Send frames to this client, once it has joined."""
        if self._held is not None:
            self._held += data
            self._give_up_beyond(len(self._held))
        else:
            self._write(data)

    def _write(self, data: bytes) -> None:
        if not self._transport.is_closing():
            self._transport.write(data)
            self._give_up_beyond(self._transport.get_write_buffer_size())

    def _give_up_beyond(self, unread_bytes: int) -> None:
        """Close where the client has stopped reading."""
        if unread_bytes > MOST_UNREAD_BYTES:
            self._give_up()

    def _give_up(self) -> None:
        self._hub.counters.given_up += 1
        self._hub.members.discard(self)
        self.abort()

    def abort(self) -> None:
        """Close at once."""
        self._transport.abort()
