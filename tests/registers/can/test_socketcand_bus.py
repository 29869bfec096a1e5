"""A socketcand server that answers wrongly, slowly or not at all: opening ends soon, in a sentence."""

import contextlib
import socket
import threading
import time

import pytest

from registers.can.bus import Bus, BusAt
from registers.can.wire import Kind


@contextlib.contextmanager
def server_that_says(*pieces):
    """Sends these to whoever connects, piece by piece, however it is answered; its port."""
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


STRANGERS = [
    ("silent", [], "timed out"),
    ("stops after its greeting", [b"< hi >"], "timed out"),
    ("stops in a word", [b"< hi >", b"< o"], "timed out"),
    ("speaks HTTP", [b"HTTP/1.1 400 Bad Request\r\n\r\n" + 200 * b"x"], "no socketcand server answers there"),
    ("has no such bus", [b"< hi >", b"< error could not open bus >"], "could not open bus"),
    ("is full", [b"< error too many clients >"], "too many clients"),
]


@pytest.mark.parametrize(("_name", "pieces", "sentence"), STRANGERS, ids=[row[0] for row in STRANGERS])
def test_a_server_that_is_none_is_given_up_soon_and_its_words_are_told(_name, pieces, sentence, monkeypatch):
    monkeypatch.setattr("registers.can.daemon._ANSWER_S", 0.2)
    with server_that_says(*pieces) as port:
        begun_s = time.monotonic()
        with pytest.raises(OSError, match=f"can0 at 127.0.0.1:{port} cannot be opened: .*{sentence}"):
            Bus(BusAt(interface="socketcand", port=port))
    assert time.monotonic() - begun_s < 8  # python-can alone waits for ever


def test_a_handshake_in_pieces_with_a_frame_glued_to_its_end_is_one():
    pieces = [b"< h", b"i >", b"< ok ", b">", b"< ok >< frame 123 1.500000 0A0B >"]
    with server_that_says(*pieces) as port:
        bus = Bus(BusAt(interface="socketcand", port=port))
        try:
            t_s, frame = bus.receive()
        finally:
            bus.close()
    assert (t_s, frame.id, frame.data) == (1.5, 0x123, b"\x0a\x0b")


def test_a_server_that_reports_errors_of_its_controller_is_understood():
    pieces = [b"< hi >", b"< ok >", b"< ok >", b"< error 004 1.000000 >< error 040 2.000000 >"]
    with server_that_says(*pieces) as port:
        bus = Bus(BusAt(interface="socketcand", port=port))
        try:
            _, frame = bus.receive()
            assert Kind.ERROR in frame.kind
            with pytest.raises(OSError, match="bus-off"):
                bus.receive()
        finally:
            bus.close()
