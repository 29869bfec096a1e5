"""The serial port: one contract, on a real pty and on a real `socket://`."""

import contextlib
import errno
import os
import select
import socket
import time
import tty

import pytest

from instrument.errors import PortBusy, PortUnavailable
from instrument.rig.port import SerialPort

PATIENCE_S = 5.0


class Pty:
    """A pty; its far end is our own side."""

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

    def go(self):
        os.close(self.far)
        self.far = -1

    def close(self):
        for descriptor in (self.far, self._near):
            if descriptor >= 0:
                os.close(descriptor)


class Tcp:
    """A rig behind a TCP port."""

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

    def go(self):
        self._peer.close()

    def close(self):
        self._listener.close()
        if self._peer:
            self._peer.close()


def _until(descriptor, count, read):
    data, deadline_s = b"", time.monotonic() + PATIENCE_S
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


def readable(port, patience_s=PATIENCE_S):
    return bool(select.select([port.fileno()], [], [], patience_s)[0])


def test_what_comes_makes_it_readable_and_is_read(far, port):
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
    assert time.monotonic() - start_s < 1.0  # a wait of 10 ms in each would show, a busy machine does not


def test_what_is_written_arrives_byte_for_byte(far, port):
    data = bytes(range(256)) * 3
    port.write(data)
    assert far.receive(len(data)) == data


def test_what_arrived_although_the_processor_was_away_is_no_lost_port(far, monkeypatch):
    monkeypatch.setattr("instrument.rig.port.WRITE_S", 1e-9)
    with contextlib.closing(SerialPort(far.url)) as port:
        far.accept()
        for _ in range(10):
            port.write(b"x" * 24)
        assert far.receive(240) == b"x" * 240


def test_a_far_end_that_takes_no_bytes_is_an_oserror(port):
    with pytest.raises(OSError, match=r"."):  # noqa: PT012
        for _ in range(10_000):
            port.write(b"x" * 4096)


def test_a_far_end_that_is_gone_is_an_oserror_at_the_next_read(far, port):
    far.go()
    assert readable(port)
    with pytest.raises(OSError, match=r"."):
        port.read()


def test_a_far_end_that_is_gone_is_an_oserror_when_writing(far, port):
    far.go()
    with pytest.raises(OSError, match=r"."):  # noqa: PT012
        for _ in range(50):  # TCP learns of it with the answer to the first write
            port.write(b"x" * 24)
            time.sleep(0.01)


def test_a_closed_port_can_be_opened_again(far, port):
    port.close()
    with contextlib.closing(SerialPort(far.url)) as again:
        far.accept()
        far.send(b"y")
        assert readable(again)
        assert again.read() == b"y"


def test_a_port_in_use_is_busy_and_the_sentence_names_it():
    with contextlib.closing(Pty()) as far, contextlib.closing(SerialPort(far.url)):
        with pytest.raises(PortBusy, match=f"{far.url} is in use") as told:
            SerialPort(far.url)
        assert isinstance(told.value, OSError)


def test_a_port_that_its_owner_has_locked_is_busy(monkeypatch):
    """TIOCEXCL, as others use it; root is let in nevertheless, so that the refusal is made up here."""

    def refuse(*_, **__):
        raise OSError(errno.EBUSY, "Device or resource busy")

    monkeypatch.setattr("serial.serial_for_url", refuse)
    with pytest.raises(PortBusy, match="in use"):
        SerialPort("/dev/ttyACM0")


@pytest.mark.parametrize(
    ("url", "says"),
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
def test_a_port_that_is_not_there_is_told_in_a_sentence_that_names_it(url, says):
    with pytest.raises(PortUnavailable, match=says) as told:
        SerialPort(url)
    assert str(told.value).startswith(url)
    assert isinstance(told.value, OSError)
