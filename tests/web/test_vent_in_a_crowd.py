"""Tests that each vent is accepted while many clients open connections and send requests."""

import contextlib
import socket
import time
from collections import Counter

import pytest

from tests.registers.modbus_security.serving import Pki
from tests.system.waiting import wait_for
from tests.web.process import crowd, web_process

OWN_ADDRESS, *OTHER_ADDRESSES = (f"127.0.0.{number}" for number in range(1, 5))
VENT_HEAD = b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n"


def vent(port, delay_s=0.0, tls=None):
    """Send a vent in pieces from an own connection. Return the HTTP status, or the name of the error."""
    try:
        with socket.create_connection(("127.0.0.1", port), 10, (OWN_ADDRESS, 0)) as raw:
            connection = tls.wrap_socket(raw, server_hostname="localhost") if tls else raw
            for piece in (VENT_HEAD[:20], VENT_HEAD[20:], b"{"):  # the last byte of the body is missing
                time.sleep(delay_s)
                connection.sendall(piece)
            return connection.recv(12)[9:].decode() or "closed"
    except OSError as error:
        return type(error).__name__


@pytest.fixture
def pki(tmp_path):
    return Pki(tmp_path / "pki")


@contextlib.contextmanager
def page(instrument, **options):
    """Start a web process that all addresses of this machine may use. Yield its port."""
    with web_process(socket=str(instrument.path), allow=["127.0.0.0/8"], **options) as (_, ready):
        wait_for(lambda: instrument.subscriptions, bool)
        yield ready["port"]


@pytest.fixture
def port(instrument):
    with page(instrument) as port:
        yield port


@pytest.fixture
def https_port(instrument, pki):
    with page(instrument, **pki.own) as port:
        yield port


@pytest.mark.parametrize(
    ("behaviours", "count", "addresses", "vents"),
    [
        ("send_half_a_body", 384, [OWN_ADDRESS], 80),
        ("send_half_a_body,be_silent", 600, [OWN_ADDRESS], 20),
        ("drip_a_head,close_at_once", 500, [OWN_ADDRESS], 20),
        ("request_in_a_loop", 384, [OWN_ADDRESS], 20),
        ("request_now_and_then,send_half_a_head", 500, [OWN_ADDRESS], 20),
        ("vent_in_a_loop", 384, [OWN_ADDRESS], 20),
        ("read_no_answer", 384, [OWN_ADDRESS], 20),
        ("follow_the_stream", 384, [OWN_ADDRESS], 20),
        ("send_half_a_body", 600, OTHER_ADDRESSES, 20),
        ("send_half_a_body,drip_a_head,request_now_and_then", 600, [OWN_ADDRESS, *OTHER_ADDRESSES], 20),
    ],
)
def test_each_vent_is_accepted(port, behaviours, count, addresses, vents):
    with crowd(port, behaviours, count, addresses):
        assert Counter(vent(port) for _ in range(vents)) == {"200": vents}


@pytest.mark.parametrize(
    ("behaviours", "count"),
    [
        ("begin_a_handshake,be_silent", 600),
        ("demand_a_handshake", 384),
        ("demand_a_handshake,request_in_a_loop,close_at_once", 500),
    ],
)
def test_each_vent_over_https_is_accepted(https_port, pki, behaviours, count):
    with crowd(https_port, behaviours, count, [OWN_ADDRESS]):
        assert Counter(vent(https_port, tls=pki.context()) for _ in range(10)) == {"200": 10}


def test_a_vent_over_a_slow_network_is_accepted(port):
    """Each piece of the request arrives 50 ms after the previous piece, as through an SSH tunnel."""
    with crowd(port, "send_half_a_body,request_now_and_then", 600, [OWN_ADDRESS]):
        assert Counter(vent(port, delay_s=0.05) for _ in range(20)) == {"200": 20}
