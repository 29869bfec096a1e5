"""Tests of the serial port: a pseudo-terminal and a TCP connection (`socket://`) behave in the same way."""

import contextlib
import errno
import os
import select
import socket
import time
import tty

import pytest

from pneuforce.errors import PortBusy, PortUnavailable
from pneuforce.support.serial_port import SerialPort

TIMEOUT_S = 5.0


class Pty:
    """Pseudo-terminal. The test controls its far end."""

    def __init__(self):
        self.far, self._near = os.openpty()
        tty.setraw(self._near)
        self.url = os.ttyname(self._near)

    def accept(self):
        pass

    def send(self, data):
        os.write(self.far, data)

    def receive(self, count):
        return _until(self.far, count, lambda: os.read(self.far, 4096))

    def disconnect(self):
        os.close(self.far)
        self.far = -1

    def close(self):
        for descriptor in (self.far, self._near):
            if descriptor >= 0:
                os.close(descriptor)


class Tcp:
    """TCP connection. The test controls its far end."""

    def __init__(self):
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self._peer = None

    def accept(self):
        self._peer = self._listener.accept()[0]

    def send(self, data):
        self._peer.sendall(data)

    def receive(self, count):
        return _until(self._peer.fileno(), count, lambda: self._peer.recv(4096))

    def disconnect(self):
        self._peer.close()

    def close(self):
        self._listener.close()
        if self._peer:
            self._peer.close()


def _until(descriptor, count, read):
    data, deadline_s = b"", time.monotonic() + TIMEOUT_S
    while len(data) < count and time.monotonic() < deadline_s:
        if select.select([descriptor], [], [], 0.1)[0]:
            data += read()
    return data


@pytest.fixture(params=[Pty, Tcp])
def far(request):
    with contextlib.closing(request.param()) as far:
        yield far


@pytest.fixture
def port(far):
    with contextlib.closing(SerialPort(far.url)) as port:
        far.accept()
        yield port


def readable(port, timeout_s=TIMEOUT_S):
    return bool(select.select([port.fileno()], [], [], timeout_s)[0])


def test_received_bytes_make_the_port_readable_and_are_read(far, port):
    assert not readable(port, 0.0)
    far.send(bytes(range(256)))
    data = b""
    while len(data) < 256:
        assert readable(port)
        data += port.read()
    assert data == bytes(range(256))


def test_reading_nothing_does_not_wait(far, port):
    start_s = time.monotonic()
    assert {port.read() for _ in range(100)} == {b""}
    assert time.monotonic() - start_s < 1.0  # 100 calls, each much shorter than 10 ms


def test_written_bytes_arrive_unchanged(far, port):
    data = bytes(range(256)) * 3
    port.write(data)
    assert far.receive(len(data)) == data


def test_a_write_that_succeeds_after_the_timeout_is_not_an_error(far, monkeypatch):
    monkeypatch.setattr("pneuforce.support.serial_port.WRITE_TIMEOUT_S", 1e-9)
    with contextlib.closing(SerialPort(far.url)) as port:
        far.accept()
        for _ in range(10):
            port.write(b"x" * 24)
        assert far.receive(240) == b"x" * 240


def test_a_far_end_that_accepts_no_bytes_raises_oserror(port):
    with pytest.raises(OSError, match=r"."):  # noqa: PT012
        for _ in range(10_000):
            port.write(b"x" * 4096)


def test_a_disconnected_far_end_raises_oserror_at_the_next_read(far, port):
    far.disconnect()
    assert readable(port)
    with pytest.raises(OSError, match=r"."):
        port.read()


def test_a_disconnected_far_end_raises_oserror_when_writing(far, port):
    far.disconnect()
    with pytest.raises(OSError, match=r"."):  # noqa: PT012
        for _ in range(50):  # TCP detects the disconnection only from the reply to the first write
            port.write(b"x" * 24)
            time.sleep(0.01)


def test_a_closed_port_can_be_opened_again(far, port):
    port.close()
    with contextlib.closing(SerialPort(far.url)) as again:
        far.accept()
        far.send(b"y")
        assert readable(again)
        assert again.read() == b"y"


def test_a_port_in_use_is_reported_with_its_name():
    with contextlib.closing(Pty()) as far, contextlib.closing(SerialPort(far.url)):
        with pytest.raises(PortBusy, match=f"{far.url} is in use") as error:
            SerialPort(far.url)
        assert isinstance(error.value, OSError)


def test_a_locked_port_is_reported_as_busy(monkeypatch):
    """TIOCEXCL locks a port. Root ignores the lock, so the test raises the error itself."""

    def raise_busy(*_, **__):
        raise OSError(errno.EBUSY, "Device or resource busy")

    monkeypatch.setattr("serial.serial_for_url", raise_busy)
    with pytest.raises(PortBusy, match="in use"):
        SerialPort("/dev/ttyACM0")


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("/dev/no-such-port", "no such port"),
        ("/dev/null", "cannot be opened"),
        ("/", "cannot be opened"),
        ("socket://127.0.0.1:1", "cannot be opened"),
        ("socket://nonsense", "cannot be opened"),
        ("nonsense://x", "cannot be opened"),
        ("", "cannot be opened"),
    ],
)
def test_a_port_that_cannot_be_opened_is_reported_with_its_name(url, reason):
    with pytest.raises(PortUnavailable, match=reason) as error:
        SerialPort(url)
    assert str(error.value).startswith(url)
    assert isinstance(error.value, OSError)
