"""Tests of the connection to a socketcand server that answers wrongly, slowly or not at all."""

import contextlib
import socket
import threading
import time

import pytest

from pneuforce.registers.can.bus import CanAddress, CanBus
from pneuforce.registers.can.wire import FrameKind


@contextlib.contextmanager
def server_that_sends(*pieces):
    """Yield the port of a server that sends these pieces to each client and ignores what the client sends."""
    with socket.create_server(("127.0.0.1", 0)) as listener, contextlib.ExitStack() as stack:

        def serve():
            with contextlib.suppress(OSError):
                while True:
                    link = stack.enter_context(listener.accept()[0])
                    with contextlib.suppress(ConnectionError):
                        for piece in pieces:
                            link.sendall(piece)
                            time.sleep(0.01)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        try:
            yield listener.getsockname()[1]
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            thread.join(5)


INVALID_SERVERS = [
    ("silent", [], "timed out"),
    ("stops after its greeting", [b"< hi >"], "timed out"),
    ("stops within a word", [b"< hi >", b"< o"], "timed out"),
    ("sends HTTP", [b"HTTP/1.1 400 Bad Request\r\n\r\n" + 200 * b"x"], "not a socketcand server"),
    ("has no such bus", [b"< hi >", b"< error could not open bus >"], "could not open bus"),
    ("is full", [b"< error too many clients >"], "too many clients"),
]


@pytest.mark.parametrize(
    ("_name", "pieces", "message_part"), INVALID_SERVERS, ids=[row[0] for row in INVALID_SERVERS]
)
def test_an_invalid_server_raises_an_error_soon(_name, pieces, message_part, monkeypatch):
    monkeypatch.setattr("pneuforce.registers.can.socketcand_bus._RESPONSE_TIMEOUT_S", 0.2)
    with server_that_sends(*pieces) as port:
        started_s = time.monotonic()
        with pytest.raises(OSError, match=f"127.0.0.1:{port} .*{message_part}"):
            CanBus(CanAddress(interface="socketcand", port=port))
    assert time.monotonic() - started_s < 8  # python-can itself waits forever


def test_a_handshake_in_pieces_and_a_frame_right_after_it_are_accepted():
    pieces = [b"< h", b"i >", b"< ok ", b">", b"< ok >< frame 123 1.500000 0A0B >"]
    with server_that_sends(*pieces) as port:
        bus = CanBus(CanAddress(interface="socketcand", port=port))
        try:
            t_s, frame = bus.receive()
        finally:
            bus.close()
    assert (t_s, frame.id, frame.data) == (1.5, 0x123, b"\x0a\x0b")


def test_error_frames_of_a_server_are_received():
    pieces = [b"< hi >", b"< ok >", b"< ok >", b"< error 004 1.000000 >< error 040 2.000000 >"]
    with server_that_sends(*pieces) as port:
        bus = CanBus(CanAddress(interface="socketcand", port=port))
        try:
            _, frame = bus.receive()
            assert FrameKind.ERROR in frame.kind
            with pytest.raises(OSError, match="bus-off"):
                bus.receive()
        finally:
            bus.close()
