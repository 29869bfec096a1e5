"""Proxies that put a bad line in front of a good one: of a TCP server, or of a serial port.

Each works in a thread of its own, from `with` to its end. Its `noise` may be changed at any time.
"""

from __future__ import annotations

import select
import socket
import threading
import time
from contextlib import suppress
from typing import Protocol, Self

from instrument.rig.port import SerialPort
from sim.cable import Cable
from sim.line_noise import Noise, NoisyLine

READ_BYTES = 4096
#: How often a line is looked at that has bytes under way.
TICK_S = 0.002
#: How long an idle proxy takes to notice that it is to end.
IDLE_S = 0.05
#: How often a port that has gone is looked for.
REOPEN_S = 0.1
GONE = -1
#: Whoever takes no bytes for longer is given up.
WRITE_S = 1.0


class End(Protocol):
    """One end of a connection."""

    def fileno(self) -> int:
        """Descriptor that becomes readable when bytes have come; `GONE` where there is none for now."""
        ...

    def read(self) -> bytes:
        """Bytes that have come, perhaps none. Raises OSError where the far side is gone."""
        ...

    def write(self, data: bytes) -> None:
        """Send. Raises OSError where the far side is gone."""
        ...

    def close(self) -> None:
        """Give it back."""
        ...


class Connection:
    """Two ends and a noisy line each way. It ends with either of its ends, once what was sent has arrived."""

    def __init__(self, near: End, far: End, noise: Noise, seed: int) -> None:
        self._ways = (near, far, NoisyLine(noise, seed)), (far, near, NoisyLine(noise, seed + 1))
        self._ends = near, far
        self._ending = False

    def filenos(self) -> list[int]:
        """Descriptors that are read."""
        numbers = [] if self._ending else [end.fileno() for end in self._ends]
        return [number for number in numbers if number != GONE]

    @property
    def busy(self) -> bool:
        """Whether bytes are under way."""
        return any(line.under_way for _, _, line in self._ways)

    def take(self, fileno: int, now_s: float) -> None:
        """Read what has come at one end."""
        source, line = next((source, line) for source, _, line in self._ways if source.fileno() == fileno)
        try:
            line.send(source.read(), now_s)
        except OSError:
            self._ending = True

    def deliver(self, now_s: float) -> bool:
        """Write what is due; False where the connection has ended."""
        for _, sink, line in self._ways:
            if data := line.due(now_s):
                try:
                    sink.write(data)
                except OSError:
                    return False
        return self.busy or not self._ending

    def close(self) -> None:
        """Close both ends."""
        for end in self._ends:
            end.close()


class _Proxy:
    """The thread that carries the bytes."""

    def __init__(self, noise: Noise | None, seed: int) -> None:
        self.noise = noise or Noise()
        self._seed = seed
        self._connections: list[Connection] = []
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

    def _connect(self, near: End, far: End) -> None:
        self._connections.append(Connection(near, far, self.noise, self._seed))
        self._seed += 2

    def _run(self) -> None:
        while not self._ended.is_set():
            sources = {fileno: c for c in self._connections for fileno in c.filenos()}
            wait_s = TICK_S if any(c.busy for c in self._connections) else IDLE_S
            readable, _, _ = select.select([*sources, *self._doors()], [], [], wait_s)
            now_s = time.monotonic()
            for fileno in readable:
                if fileno in sources:
                    sources[fileno].take(fileno, now_s)
                else:
                    self._admit()
            self._deliver(now_s)
            self._mend(now_s)

    def _deliver(self, now_s: float) -> None:
        ended = [c for c in self._connections if not c.deliver(now_s)]
        for connection in ended:
            connection.close()
            self._connections.remove(connection)

    def _doors(self) -> list[int]:
        """Descriptors that become readable when somebody new has come."""
        return []

    def _admit(self) -> None:
        """Let in who has come."""

    def _mend(self, now_s: float) -> None:
        """Look after what has gone."""


class TcpProxy(_Proxy):
    """A TCP port in front of a server. Clients connect to `port` on the loopback."""

    def __init__(self, target: tuple[str, int], noise: Noise | None = None, seed: int = 1) -> None:
        """Listen on a free port for the server at `target` (host, port)."""
        super().__init__(noise, seed)
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]

    def __exit__(self, *_: object) -> None:
        super().__exit__()
        self._listener.close()

    def _doors(self) -> list[int]:
        return [self._listener.fileno()]

    def _admit(self) -> None:
        client, _ = self._listener.accept()
        try:
            server = socket.create_connection(self._target, WRITE_S)
        except OSError:
            client.close()
            return
        self._connect(_Stream(client), _Stream(server))


class _Stream:
    """A TCP socket as an end; pieces go out as they are."""

    def __init__(self, stream: socket.socket) -> None:
        stream.settimeout(WRITE_S)
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


class _Line:
    """A serial port as an end: what it does not take is lost, as on a wire. One that has gone comes back."""

    def __init__(self, url: str) -> None:
        """Raises PortBusy or PortUnavailable."""
        self._url = url
        self._port: SerialPort | None = SerialPort(url)
        self._try_again_s = 0.0

    def fileno(self) -> int:
        return self._port.fileno() if self._port else GONE

    def read(self) -> bytes:
        try:
            return self._port.read() if self._port else b""
        except OSError:
            self.close()
            return b""

    def write(self, data: bytes) -> None:
        if self._port:
            with suppress(OSError):
                self._port.write(data)

    def close(self) -> None:
        port, self._port = self._port, None
        if port:
            port.close()

    def mend(self, now_s: float) -> None:
        """Open the port where it has gone; its name may lead to another device now."""
        if self._port or now_s < self._try_again_s:
            return
        self._try_again_s = now_s + REOPEN_S
        with suppress(OSError):
            self._port = SerialPort(self._url)


class SerialProxy(_Proxy):
    """A serial port (a pty) in front of another. The host opens `port`.

    It stays when the one behind it goes, silent until that is back under the same name.
    """

    def __init__(self, port: str, noise: Noise | None = None, seed: int = 1) -> None:
        """Open the port in front of which this one stands. Raises PortBusy or PortUnavailable."""
        super().__init__(noise, seed)
        self._line, near = _Line(port), Cable()
        self.port = near.port
        self._connect(near, self._line)

    def _mend(self, now_s: float) -> None:
        self._line.mend(now_s)
