"""A CAN bus between processes where the kernel has none: a small hub that speaks the socketcand protocol.

Run it with `python -m registers.can.hub --port 29536`; python-can's `socketcand` interface is a client.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import signal
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

from registers.can.socketcand import GREETING, NO_SUCH_BUS, OK, Decoder, frame_of_send

HOST = "127.0.0.1"
PORT = 29536
CHANNEL = "can0"
#: python-can's handshake takes a frame that comes glued to the last "ok" for a failure.
JOIN_AFTER_S = 0.1
#: What the kernel may keep: the less, the sooner a client notices that this hub stands, and the less is old.
KERNEL_UNREAD_BYTES, KERNEL_UNSENT_BYTES = 1024, 1 << 16
#: After standing for longer than the first, frames are dropped until the second is over: they are old.
STOOD_S, SETTLE_S = 0.25, 0.1
BEAT_S = 0.02
#: Unread bytes, some 20 000 frames, at which a client is taken for dead.
MOST_UNREAD_BYTES = 1 << 20


@dataclass(slots=True)
class Counters:
    """What the hub has seen since it was made."""

    connections: int = 0
    frames: int = 0  #: passed on
    garbage: int = 0  #: pieces of text that were no message, or none at that moment
    given_up: int = 0  #: clients closed because they did not read
    late: int = 0  #: frames dropped because this process had stood still


class Hub:
    """Passes each client's frames on to all the others."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self.counters = Counters()
        self.clock = clock
        self.members: set[_Client] = set()
        self._clients: set[_Client] = set()
        self._server: asyncio.Server | None = None
        self._beat_s = 0.0
        self._fresh_from_s = 0.0
        self._next_beat: asyncio.TimerHandle | None = None

    async def start(self, port: int = PORT) -> int:
        """Listen on loopback; the port, which differs from `port` where that is 0. Raises OSError."""
        loop = asyncio.get_running_loop()
        listener = socket.create_server((HOST, port))
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_UNREAD_BYTES)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_UNSENT_BYTES)
        self._server = await loop.create_server(lambda: _Client(self), sock=listener)
        self._beat_s = loop.time()
        self._beat()
        bound: int = self._server.sockets[0].getsockname()[1]
        return bound

    def close(self) -> None:
        """Stop listening and let all clients go."""
        if self._server is not None:
            self._server.close()
        if self._next_beat is not None:
            self._next_beat.cancel()
        for client in list(self._clients):
            client.abort()

    def _beat(self) -> None:
        loop = asyncio.get_running_loop()
        if self._has_stood():
            self._fresh_from_s = loop.time() + SETTLE_S
        self._beat_s = loop.time()
        self._next_beat = loop.call_later(BEAT_S, self._beat)

    def _has_stood(self) -> bool:
        return asyncio.get_running_loop().time() - self._beat_s > STOOD_S

    def came(self, client: _Client) -> None:
        """A client has connected."""
        self.counters.connections += 1
        self._clients.add(client)

    def went(self, client: _Client) -> None:
        """A client is gone."""
        self._clients.discard(client)
        self.members.discard(client)

    def pass_on(self, frames: list[bytes], sender: _Client) -> None:
        """Give frames to all members but their sender; drop them where they waited for this process."""
        if self._has_stood() or asyncio.get_running_loop().time() < self._fresh_from_s:
            self.counters.late += len(frames)
            return
        self.counters.frames += len(frames)
        data = b"".join(frames)
        for member in list(self.members):
            if member is not sender:
                member.give(data)


class _Client(asyncio.Protocol):
    """One connection: first its handshake, then frames."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._decoder = Decoder()
        self._opened = False
        self._held: bytearray | None = bytearray()  #: what the others sent until this client has joined

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._hub.came(self)
        transport.write(GREETING)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        self._hub.went(self)

    def data_received(self, data: bytes) -> None:
        """Answer the handshake; pass frames on, those that came together together."""
        garbage_before = self._decoder.garbage
        frames = []
        for words in self._decoder.feed(data):
            if self in self._hub.members:
                frame = frame_of_send(words, self._hub.clock())
                if frame is None:
                    self._hub.counters.garbage += 1
                else:
                    frames.append(frame)
            else:
                self._shake_hands(words)
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
            asyncio.get_running_loop().call_later(JOIN_AFTER_S, self._join)
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
            self._hub.counters.given_up += 1
            self._hub.members.discard(self)
            self.abort()

    def abort(self) -> None:
        """Close at once."""
        self._transport.abort()


async def _serve(port: int) -> None:
    hub = Hub()
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    bound = await hub.start(port)
    print(json.dumps({"port": bound}), flush=True)
    await stop.wait()
    hub.close()


def main() -> int:
    """Run a hub until SIGTERM or Ctrl-C; prints one JSON line with its port once it listens."""
    parser = argparse.ArgumentParser(prog="python -m registers.can.hub", description=main.__doc__)
    parser.add_argument("--port", type=int, default=PORT, help="TCP port on loopback; 0 takes a free one")
    port: int = parser.parse_args().port
    try:
        asyncio.run(_serve(port))
    except (OSError, OverflowError) as error:
        print(f"the CAN hub cannot listen on {HOST}:{port}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
