"""CAN hub: a CAN bus between processes on a machine whose kernel does not support CAN.

The hub is a socketcand server. Start it with `pneuforce hub --port 29536`, and connect with python-can's
`socketcand` interface. The hub supports raw mode and data frames with 11-bit and 29-bit identifiers. Remote
frames are not supported, as in socketcand. A client that does not begin with the handshake is disconnected,
because a web page in a browser can connect to the hub as well.
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

from pneuforce.registers.can.hub_client import HubClient, HubCounters

HOST = "127.0.0.1"
PORT = 29536
MAX_CLIENTS = 64  #: a further client receives an error message and is disconnected
#: Size of the kernel's buffers for a client. If a buffer is smaller than a segment of loopback TCP, the
#: transfer is very slow: 5 frames in 0.2 s.
KERNEL_BUFFER_BYTES = 1 << 16
#: If this process was suspended for longer than SUSPENDED_S, frames are dropped during the next SETTLE_S,
#: because they are too old.
SUSPENDED_S, SETTLE_S = 0.25, 0.1
CHECK_PERIOD_S = 0.02


class Hub:
    """CAN hub that forwards the frames of each client to all other clients."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self.counters = HubCounters()
        self.members: set[HubClient] = set()
        self.clock = clock
        self._clients: set[HubClient] = set()
        self._server: asyncio.Server | None = None
        self._checked_s = 0.0
        self._forward_from_s = 0.0
        self._next_check: asyncio.TimerHandle | None = None

    async def start(self, port: int = PORT) -> int:
        """Listen on the loopback interface and return the port; 0 selects a free port. Raises OSError."""
        loop = asyncio.get_running_loop()
        listener = socket.create_server((HOST, port))
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BUFFER_BYTES)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BUFFER_BYTES)
        self._server = await loop.create_server(lambda: HubClient(self), sock=listener)
        self._checked_s = loop.time()
        self._check_suspension()
        bound: int = self._server.sockets[0].getsockname()[1]
        return bound

    def close(self) -> None:
        """Stop listening and disconnect all clients."""
        if self._server is not None:
            self._server.close()
        if self._next_check is not None:
            self._next_check.cancel()
        for client in list(self._clients):
            client.abort()

    def _check_suspension(self) -> None:
        loop = asyncio.get_running_loop()
        if self._was_suspended():
            self._forward_from_s = loop.time() + SETTLE_S
        self._checked_s = loop.time()
        self._next_check = loop.call_later(CHECK_PERIOD_S, self._check_suspension)

    def _was_suspended(self) -> bool:
        return asyncio.get_running_loop().time() - self._checked_s > SUSPENDED_S

    def add(self, client: HubClient) -> bool:
        """Add a connected client; return False if the hub is full."""
        self.counters.connections += 1
        if len(self._clients) >= MAX_CLIENTS:
            self.counters.rejected_clients += 1
            return False
        self._clients.add(client)
        return True

    def remove(self, client: HubClient) -> None:
        """Remove a client that has disconnected."""
        self._clients.discard(client)
        self.members.discard(client)

    def forward(self, frames: list[bytes], sender: HubClient) -> None:
        """Send `frames` to all clients in `members` except `sender`.

        Frames that arrived while this process was suspended are dropped.
        """
        if self._was_suspended() or asyncio.get_running_loop().time() < self._forward_from_s:
            self.counters.late += len(frames)
            return
        self.counters.frames += len(frames)
        data = b"".join(frames)
        for member in list(self.members):
            if member is not sender:
                member.send_frames(data)


def run(port: int) -> None:
    """Run a CAN hub until SIGTERM or Ctrl-C; print one JSON line with the port when the hub listens.

    0 selects a free port. Raises OSError with the cause and the remedy if the hub cannot listen.
    """
    try:
        asyncio.run(_serve(port))
    except (OSError, OverflowError) as error:
        in_use = isinstance(error, OSError) and error.errno == errno.EADDRINUSE
        reason = "the port is in use. Choose another port with --port" if in_use else error
        raise OSError(f"the CAN hub cannot listen on {HOST}:{port}: {reason}") from None


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
    """Run a CAN hub as `pneuforce hub` does. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m pneuforce.registers.can.hub", description=run.__doc__)
    parser.add_argument("--port", type=int, default=PORT, help="TCP port on loopback; 0 selects a free port")
    try:
        run(parser.parse_args().port)
    except OSError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
