"""Tests of the control port with clients that do not use its protocol, for example a web page."""

import contextlib
import http.client
import json
import socket
import ssl
import threading

import pytest

from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.rig import Rig
from pneuforce.sim.server.client import SimulatorClient
from pneuforce.sim.server.control_server import ControlServer
from pneuforce.sim.world import World
from tests.sockets import is_closed

LEAK = '{"fault": {"name": "leak", "kpa_per_s": 1.0}}\n'
FIRST_BYTES = [
    "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" + LEAK,
    "POST / HTTP/1.1\r\n" + "X: y\r\n" * 2000 + "\r\n" + LEAK,
    "\r\n" + LEAK,
    "\n" * 600 + LEAK,
    "\x16\x03\x01\x02\x00\x01\x00\n" + LEAK,
    "hello\n" + LEAK,
    "[]\n" + LEAK,
    "{}\n" + LEAK,
    '{"vent": true}\n' + LEAK,
    '{"faults": true, "release": true}\n' + LEAK,
    "{ POST / HTTP/1.1\r\n\r\n" + LEAK,
]


@pytest.fixture
def control():
    """Yield a control server whose simulation runs in a thread."""
    ended = threading.Event()
    with contextlib.closing(ControlServer(0, World(Rig(PublishedPlant(), Hand(False))))) as server:

        def run():
            while not ended.wait(0.001):
                server.serve(server.filenos())
                server.publish()

        thread = threading.Thread(target=run)
        thread.start()
        yield server
        ended.set()
        thread.join()


def faults(control):
    return SimulatorClient(control.port).faults()


@pytest.mark.parametrize("text", FIRST_BYTES, ids=range(len(FIRST_BYTES)))
@pytest.mark.parametrize("size", [1, 1 << 20])
def test_a_client_whose_first_line_is_no_request_is_disconnected_before_a_request_is_executed(
    control, text, size
):
    data = text.encode("latin-1")
    with socket.create_connection(("127.0.0.1", control.port), timeout=5) as link:
        with contextlib.suppress(ConnectionError):
            for at in range(0, len(data), size):
                link.sendall(data[at : at + size])
        assert is_closed(link)
    assert faults(control) == []


@pytest.mark.parametrize("method", ["POST", "PUT", "GET", "OPTIONS"])
def test_an_http_request_of_a_web_page_has_no_effect(control, method):
    request = http.client.HTTPConnection("127.0.0.1", control.port, timeout=60)
    with contextlib.suppress(ConnectionError):
        headers = {"Content-Type": "text/plain;charset=UTF-8", "Origin": "http://example.com"}
        request.request(method, "/", f"\n{LEAK}\n{LEAK}", headers)
        assert is_closed(request.sock)
    request.close()
    assert faults(control) == []


def test_a_tls_client_is_disconnected(control):
    with socket.create_connection(("127.0.0.1", control.port), timeout=5) as link:
        context = ssl.create_default_context()
        with pytest.raises(OSError), context.wrap_socket(link, server_hostname="localhost"):  # noqa: PT011
            pass
    assert faults(control) == []


def test_a_first_object_with_an_unknown_key_is_answered_before_the_connection_is_closed(control):
    with socket.create_connection(("127.0.0.1", control.port), timeout=5) as link:
        link.sendall(b'{"vent": true}\n' + LEAK.encode())
        lines = link.makefile().readlines()
    assert [set(json.loads(line)) for line in lines] == [{"error"}]


def test_unknown_lines_after_the_first_request_have_no_effect(control):
    with socket.create_connection(("127.0.0.1", control.port), timeout=5) as link:
        link.sendall(b'{"faults": true}\nPOST / HTTP/1.1\r\n\r\n{"vent": true}\n{"faults": true}\n')
        lines = link.makefile()
        received = [json.loads(lines.readline()) for _ in range(4)]
    assert [set(answer) for answer in received] == [{"faults"}, {"error"}, {"error"}, {"faults"}]
    assert faults(control) == []
