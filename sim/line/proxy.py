"""Proxies that add line noise in front of a TCP server or of a serial port.

Each proxy runs in its own thread while its context manager is active. Its `noise` may be changed at any time.
"""

from __future__ import annotations

import socket
import threading
import time
from contextlib import suppress
from typing import Protocol, Self

from pneuforce.sim.line.line_noise import LineNoise, NoisyLine
from pneuforce.sim.line.pty_link import PtyLink
from pneuforce.support.readiness import is_writable, readable
from pneuforce.support.serial_port import SerialPort

READ_BYTES = 4096
#: Polling interval while bytes are in transit [s].
TICK_S = 0.002
#: Polling interval of an idle proxy [s]. An idle proxy takes up to this time to end.
IDLE_S = 0.05
#: Interval of the attempts to reopen a port [s].
REOPEN_S = 0.1
NO_DESCRIPTOR = -1
#: Time after which a peer that accepts no bytes is disconnected [s].
WRITE_TIMEOUT_S = 1.0


class Endpoint(Protocol):
    """Endpoint of a proxied connection."""

    def fileno(self) -> int:
        """Return the descriptor that becomes readable when bytes have arrived, or `NO_DESCRIPTOR`."""
        ...

    def read(self) -> bytes:
        """Return the received bytes; b"" if there are none. Raises OSError if the peer has disconnected."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes. Raises OSError if the peer has disconnected."""
        ...

    def close(self) -> None:
        """Close the endpoint."""
        ...


class ProxyConnection:
    """Two endpoints with a noisy line in each direction.

    When one endpoint ends, the connection ends after all bytes in transit have arrived.
    """

    def __init__(self, near: Endpoint, far: Endpoint, noise: LineNoise, seed: int) -> None:
        self._directions = (near, far, NoisyLine(noise, seed)), (far, near, NoisyLine(noise, seed + 1))
        self._endpoints = near, far
        self._ending = False

    def filenos(self) -> list[int]:
        """Return the descriptors to read from."""
        numbers = [] if self._ending else [endpoint.fileno() for endpoint in self._endpoints]
        return [number for number in numbers if number != NO_DESCRIPTOR]

    @property
    def busy(self) -> bool:
        """Return True if bytes are in transit."""
        return any(line.in_transit for _, _, line in self._directions)

    def receive(self, fileno: int, now_s: float) -> None:
        """Read the bytes of one endpoint and send them over its line."""
        source, line = next(
            (source, line) for source, _, line in self._directions if source.fileno() == fileno
        )
        try:
            line.send(source.read(), now_s)
        except OSError:
            self._ending = True

    def deliver(self, now_s: float) -> bool:
        """Write the bytes that have arrived. Return False if the connection has ended."""
        for _, sink, line in self._directions:
            if data := line.receive(now_s):
                try:
                    sink.write(data)
                except OSError:
                    return False
        return self.busy or not self._ending

    def close(self) -> None:
        """Close both endpoints."""
        for endpoint in self._endpoints:
            endpoint.close()


class _Proxy:
    """Base class of the proxies, with the thread that transfers the bytes."""

    def __init__(self, noise: LineNoise | None, seed: int) -> None:
        self.noise: LineNoise = noise or LineNoise()
        self._seed = seed
        self._connections: list[ProxyConnection] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="proxy", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        for connection in self._connections:
            connection.close()

    def _connect(self, near: Endpoint, far: Endpoint) -> None:
        self._connections.append(ProxyConnection(near, far, self.noise, self._seed))
        self._seed += 2

    def _run(self) -> None:
        while not self._ended.is_set():
            sources = {fileno: c for c in self._connections for fileno in c.filenos()}
            wait_s = TICK_S if any(c.busy for c in self._connections) else IDLE_S
            for fileno in readable([*sources, *self._listening_filenos()], wait_s):
                if fileno in sources:
                    sources[fileno].receive(fileno, time.monotonic())
                else:
                    self._accept()
            now_s = time.monotonic()
            self._deliver(now_s)
            self._reopen(now_s)

    def _deliver(self, now_s: float) -> None:
        ended = [c for c in self._connections if not c.deliver(now_s)]
        for connection in ended:
            connection.close()
            self._connections.remove(connection)

    def _listening_filenos(self) -> list[int]:
        """Return the descriptors that become readable when a new client connects."""
        return []

    def _accept(self) -> None:
        """Accept a new client."""

    def _reopen(self, now_s: float) -> None:
        """Reopen lost ports."""


class TcpProxy(_Proxy):
    """TCP port in front of a server. Clients connect to `port` on the loopback interface.

    The attributes of `noise`, a `LineNoise`, disturb the data, and may be changed at any time.
    """

    def __init__(self, target: tuple[str, int], noise: LineNoise | None = None, seed: int = 1) -> None:
        """Listen on a free port for the server at `target` (host, port)."""
        super().__init__(noise, seed)
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]  #: TCP port for the clients

    def __exit__(self, *_: object) -> None:
        super().__exit__()
        self._listener.close()

    def _listening_filenos(self) -> list[int]:
        return [self._listener.fileno()]

    def _accept(self) -> None:
        client, _ = self._listener.accept()
        try:
            server = socket.create_connection(self._target, WRITE_TIMEOUT_S)
        except OSError:
            client.close()
            return
        self._connect(_TcpEndpoint(client), _TcpEndpoint(server))


class _TcpEndpoint:
    """TCP socket as an endpoint. Nagle's algorithm is off, so that bytes are sent at once."""

    def __init__(self, stream: socket.socket) -> None:
        stream.settimeout(WRITE_TIMEOUT_S)
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._stream = stream
        self.fileno = stream.fileno
        self.write = stream.sendall
        self.close = stream.close

    def read(self) -> bytes:
        data = self._stream.recv(READ_BYTES)
        if not data:
            raise ConnectionResetError
        return data


class _SerialEndpoint:
    """Serial port as an endpoint.

    Bytes that the port does not accept are lost, as on a wire. A lost port is reopened.
    """

    def __init__(self, url: str) -> None:
        """Open the port. Raises PortBusy or PortUnavailable."""
        self._url = url
        self._port: SerialPort | None = SerialPort(url)
        self._next_attempt_s = 0.0

    def fileno(self) -> int:
        return self._port.fileno() if self._port else NO_DESCRIPTOR

    def read(self) -> bytes:
        try:
            return self._port.read() if self._port else b""
        except OSError:
            self.close()
            return b""

    def write(self, data: bytes) -> None:
        if self._port:
            with suppress(OSError):
                if is_writable(self._port.fileno(), 0.0):
                    self._port.write(data)

    def close(self) -> None:
        port, self._port = self._port, None
        if port:
            port.close()

    def reopen(self, now_s: float) -> None:
        """Reopen the port if it was lost. Its name may now refer to another device."""
        if self._port or now_s < self._next_attempt_s:
            return
        self._next_attempt_s = now_s + REOPEN_S
        with suppress(OSError):
            self._port = SerialPort(self._url)


class SerialProxy(_Proxy):
    """Pseudo-terminal in front of a serial port. The host opens `port`.

    The attributes of `noise`, a `LineNoise`, disturb the data, and may be changed at any time.

    If the serial port disappears, the pseudo-terminal remains. It sends no bytes until a serial port with the
    same name appears.
    """

    def __init__(self, port: str, noise: LineNoise | None = None, seed: int = 1) -> None:
        """Open the serial port behind the proxy. Raises PortBusy or PortUnavailable."""
        super().__init__(noise, seed)
        self._serial, near = _SerialEndpoint(port), PtyLink()
        self.port: str = near.port  #: path of the serial port for the instrument
        self._connect(near, self._serial)

    def _reopen(self, now_s: float) -> None:
        self._serial.reopen(now_s)
