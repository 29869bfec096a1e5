"""Tests of the connection limiter without a network: it ends for any course of connections."""

import random

import pytest

from pneuforce.web.server.connection_limiter import MAX_CONNECTIONS_PER_ADDRESS, ConnectionLimiter
from pneuforce.web.server.eviction import Protection


class Connection:
    """Connection whose end the limiter learns later, as from an event loop."""

    has_unread_bytes = False

    def __init__(self, port):
        self.client = ("127.0.0.1", port)
        self.protection = Protection.LATER
        self.transport = self
        self.aborted = False

    def discard_unsent(self):
        pass

    def abort(self):
        self.aborted = True


@pytest.fixture
def limiter():
    return ConnectionLimiter([])


def test_a_new_connection_from_the_port_of_an_ended_one_replaces_it(limiter):
    """A client can use its port again before the event loop reports the end of the former connection."""
    former, new = Connection(1), Connection(1)
    limiter.admit(former)
    limiter.admit(new)
    limiter.remove(former)
    assert (former.aborted, new.aborted, len(limiter)) == (True, False, 1)


def test_the_limit_holds_for_clients_that_use_their_ports_again(limiter):
    for _ in range(2):
        for port in range(MAX_CONNECTIONS_PER_ADDRESS + 10):
            limiter.admit(Connection(port))
    assert len(limiter) == MAX_CONNECTIONS_PER_ADDRESS


def test_random_connections_stay_below_the_limit_and_leave_nothing(limiter):
    chance = random.Random(1)
    open_connections = []
    for _ in range(5000):
        if open_connections and chance.random() < 0.4:
            connection = open_connections.pop(chance.randrange(len(open_connections)))
            chance.choice((limiter.remove, limiter.update))(connection)
        else:
            open_connections.append(Connection(chance.randrange(1000)))
            limiter.admit(open_connections[-1])
        assert len(limiter) <= MAX_CONNECTIONS_PER_ADDRESS
    for connection in open_connections:
        limiter.remove(connection)
        limiter.update(connection)
    for port in range(1000):
        limiter.disconnect(("127.0.0.1", port))
    assert len(limiter) == 0
