"""Tests of the listening socket, which skips connections that the client has already closed."""

import contextlib
import socket

import pytest

from pneuforce.web.server.listener import open_listener
from tests.system.waiting import wait_for

VENT = b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.fixture
def listener():
    with open_listener("127.0.0.1", 0) as listener:
        listener.setblocking(False)
        yield listener


def accept(listener):
    """Return the address of the next client that has not closed its connection."""

    def try_to_accept():
        with contextlib.suppress(BlockingIOError):
            connection, address = listener.accept()
            connection.close()
            return address

    return wait_for(try_to_accept, bool)


@pytest.mark.parametrize("sent", [b"", b"GET /api/live HTTP/1.1\r\n\r\n", b"POST /api/"])
def test_a_closed_connection_is_skipped_even_if_the_client_has_sent_data(listener, sent):
    for _ in range(5):
        with socket.create_connection(listener.getsockname()) as closed:
            closed.sendall(sent)
    with socket.create_connection(listener.getsockname()) as client:
        assert accept(listener) == client.getsockname()


@pytest.mark.parametrize("sent", [b"", b"GET /api/live HTTP/1.1\r\n\r\n"])
def test_an_open_connection_is_not_skipped(listener, sent):
    with socket.create_connection(listener.getsockname()) as client:
        client.sendall(sent)
        assert accept(listener) == client.getsockname()


def test_a_vent_is_executed_even_if_the_client_does_not_wait_for_the_answer(site, instrument):
    with socket.create_connection(("127.0.0.1", site.port), 5) as client:
        client.sendall(VENT)
    wait_for(lambda: instrument.requests, [{"mode": "vent"}].__eq__)
