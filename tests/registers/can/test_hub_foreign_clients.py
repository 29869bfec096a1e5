"""Tests of the hub with clients that do not use socketcand, for example a web page in a browser."""

import contextlib
import http.client
import socket
import ssl

import pytest

from tests.registers.can.raw_client import RawHubClient
from tests.sockets import is_closed

COMMANDS = "< open can0 >< rawmode >< send 205 8 70 17 02 00 00 00 00 00 >"
LATER = "< send 7FF 0 >"
FIRST_BYTES = [
    "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" + COMMANDS,
    "POST / HTTP/1.1\r\n" + "X: y\r\n" * 1000 + "\r\n" + COMMANDS,
    "x" + COMMANDS,
    "\x16\x03\x01\x02\x00\x01\x00" + COMMANDS,
    "< send 205 8 70 17 02 00 00 00 00 00 >" + COMMANDS,
    "< rawmode >" + COMMANDS,
    "< echo >" + COMMANDS,
    "< >" + COMMANDS,
    "< POST " + COMMANDS,
    "<<" + COMMANDS,
    "<" * 300 + COMMANDS,
    "< open can0 >POST / HTTP/1.1\r\n\r\n< rawmode >< send 205 0 >",
    "< open can0 >< bcmmode >< rawmode >< send 205 0 >",
    "< open can7 >< rawmode >" + COMMANDS,
]


@pytest.fixture
def member(hub_port):
    client = RawHubClient(hub_port).join()
    yield client
    client.link.close()


def received_after(member, hub_port):
    """Return the next frame of `member`. A correct client sends a frame with the identifier 7FF."""
    with contextlib.closing(RawHubClient(hub_port).join().link) as link:
        link.sendall(LATER.encode())
        return member.frames(1)


@pytest.mark.parametrize("text", FIRST_BYTES, ids=range(len(FIRST_BYTES)))
@pytest.mark.parametrize("size", [1, 1 << 20])
def test_a_client_whose_first_messages_are_wrong_is_disconnected_before_a_frame_passes(
    member, hub_port, text, size
):
    data = text.encode("latin-1")
    with contextlib.closing(RawHubClient(hub_port).link) as link:
        with contextlib.suppress(ConnectionError):
            for at in range(0, len(data), size):
                link.sendall(data[at : at + size])
        assert is_closed(link)
    assert received_after(member, hub_port) == ["< frame 7FF >"]


@pytest.mark.parametrize("method", ["POST", "PUT", "GET", "OPTIONS"])
def test_an_http_request_of_a_web_page_sends_no_frame(member, hub_port, method):
    request = http.client.HTTPConnection("127.0.0.1", hub_port, timeout=60)
    with contextlib.suppress(ConnectionError):
        headers = {"Content-Type": "text/plain;charset=UTF-8", "Origin": "http://example.com"}
        request.request(method, "/", f"{COMMANDS}\r\n{COMMANDS}", headers)
        assert is_closed(request.sock)
    request.close()
    assert received_after(member, hub_port) == ["< frame 7FF >"]


def test_a_tls_client_is_disconnected(hub_port):
    with socket.create_connection(("127.0.0.1", hub_port), timeout=5) as link:
        assert link.recv(6) == b"< hi >"
        context = ssl.create_default_context()
        with pytest.raises(OSError), context.wrap_socket(link, server_hostname="localhost"):  # noqa: PT011
            pass


def test_unknown_messages_of_a_member_have_no_effect(member, hub_port):
    with contextlib.closing(RawHubClient(hub_port).join().link) as link:
        link.sendall(b"< open can7 >< frame 205 0.0 00 >< sendx 205 0 >POST / HTTP/1.1\r\n\r\n")
        link.sendall(LATER.encode())
        assert member.frames(1) == ["< frame 7FF >"]
