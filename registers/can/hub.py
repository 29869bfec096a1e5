"""A CAN bus between processes where the kernel has none: a small hub that speaks the socketcand protocol.

Run it with `python -m registers.can.hub --port 29536`; python-can's `socketcand` interface is a client.
It knows raw mode, and data frames with 11 and 29 bits; no remote frames, as socketcand itself.
"""

from __future__ import annotations

import argparse
import asyncio
import errno
import json
import signal
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

from registers.can.hub_client import HubClient

HOST = "127.0.0.1"
PORT = 29536
MOST_CLIENTS = 64  #: who is in stays in; the next one is told, and closed
#: What the kernel may keep for a client. With less than a segment of loopback TCP crawls: 5 frames in 0.2 s.
KERNEL_BYTES = 1 << 16
#: After standing for longer than the first, frames are dropped until the second is over: they are old.
STOOD_S, SETTLE_S = 0.25, 0.1
BEAT_S = 0.02


@dataclass(slots=True)
class Counters:
    """What the hub has seen since it was made."""

    connections: int = 0
    frames: int = 0  #: passed on
    garbage: int = 0  #: pieces of text that were no message, or none at that moment
    turned_away: int = 0  #: clients closed because there were too many
    given_up: int = 0  #: clients closed because they did not read, or did not shake hands in time
    late: int = 0  #: frames dropped because this process had stood still


class Hub:
    """Passes each client's frames on to all the others."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self.counters = Counters()
        self.clock = clock
        self.members: set[HubClient] = set()
        self._clients: set[HubClient] = set()
        self._server: asyncio.Server | None = None
        self._beat_s = 0.0
        self._fresh_from_s = 0.0
        self._next_beat: asyncio.TimerHandle | None = None

    async def start(self, port: int = PORT) -> int:
        """Listen on loopback; the port, which differs from `port` where that is 0. Raises OSError."""
        loop = asyncio.get_running_loop()
        listener = socket.create_server((HOST, port))
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BYTES)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BYTES)
        self._server = await loop.create_server(lambda: HubClient(self), sock=listener)
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

    def came(self, client: HubClient) -> bool:
        """A client has connected; whether there is room for it."""
        self.counters.connections += 1
        if len(self._clients) >= MOST_CLIENTS:
            self.counters.turned_away += 1
            return False
        self._clients.add(client)
        return True

    def went(self, client: HubClient) -> None:
        """A client is gone."""
        self._clients.discard(client)
        self.members.discard(client)

    def pass_on(self, frames: list[bytes], sender: HubClient) -> None:
        """Give frames to all members but their sender; drop them where they waited for this process."""
        if self._has_stood() or asyncio.get_running_loop().time() < self._fresh_from_s:
            self.counters.late += len(frames)
            return
        self.counters.frames += len(frames)
        data = b"".join(frames)
        for member in list(self.members):
            if member is not sender:
                member.give(data)


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
        busy = isinstance(error, OSError) and error.errno == errno.EADDRINUSE
        why = "it is in use; --port takes another" if busy else error
        print(f"the CAN hub cannot listen on {HOST}:{port}: {why}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
