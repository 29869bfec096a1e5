"""Tests with many connections, slow browsers, and connections that send nothing."""

import contextlib
import itertools
import json
import socket
import statistics
import time

from pneuforce.web.event_stream import MAX_STREAMS, SseMessage
from pneuforce.web.server.connection_limiter import MAX_CONNECTIONS, MAX_CONNECTIONS_PER_ADDRESS
from tests.system.waiting import wait_for
from tests.web.entries import sample, snapshot
from tests.web.process import crowd, request, web_process
from tests.web.serving import Site, until

MESSAGE = SseMessage("event", {"text": "still connected"})


def broadcast(site, message):
    """Send a message to all browsers."""
    site.services.broadcaster.send([message], time.monotonic())


def counts(site):
    """Return the number of event streams and the number of connections."""
    return len(site.services.broadcaster), len(site.services.limiter)


def test_two_hundred_silent_connections_do_not_prevent_a_vent(site):
    with contextlib.ExitStack() as connections:
        for _ in range(200):
            connections.enter_context(contextlib.closing(socket.create_connection(("127.0.0.1", site.port))))
        assert site.post("/api/vent", {})[0] == 200


@contextlib.contextmanager
def connections_from(site, address, count):
    """Open connections from one address of this machine."""
    with contextlib.ExitStack() as connections:
        yield [
            connections.enter_context(
                contextlib.closing(socket.create_connection(("127.0.0.1", site.port), 5, (address, 0)))
            )
            for _ in range(count)
        ]


def test_the_total_number_of_connections_is_limited(instrument):
    site = Site(instrument.path, allow=["127.0.0.0/8"])
    others = MAX_CONNECTIONS - MAX_CONNECTIONS_PER_ADDRESS + 50
    with (
        site.event_stream() as stream,
        connections_from(site, "127.0.0.2", MAX_CONNECTIONS_PER_ADDRESS),
        connections_from(site, "127.0.0.3", others),
    ):
        wait_for(lambda: counts(site)[1], lambda count: count == MAX_CONNECTIONS)
        assert site.post("/api/vent", {})[0] == 200
        assert next(stream)[0] == "link"  # the stream is the oldest connection, and is not aborted
        broadcast(site, MESSAGE)
        assert until(stream, "event") == MESSAGE.data
    site.stop()


def test_an_address_with_too_many_connections_loses_its_own_connections(instrument):
    site = Site(instrument.path, allow=["127.0.0.0/8"])
    with (
        connections_from(site, "127.0.0.2", 1) as (other,),
        connections_from(site, "127.0.0.3", MAX_CONNECTIONS_PER_ADDRESS + 50) as many,
    ):
        wait_for(lambda: counts(site)[1], lambda count: count == MAX_CONNECTIONS_PER_ADDRESS + 1)
        many[0].settimeout(5)
        assert many[0].recv(1) == b""
        other.sendall(b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert other.recv(100).startswith(b"HTTP/1.1 200")
    site.stop()


def test_a_pending_request_is_answered_even_if_many_connections_follow(site, instrument):
    instrument.answers = False
    with connections_from(site, "127.0.0.1", 1) as (client,):
        client.sendall(b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\n\r\n")
        with connections_from(site, "127.0.0.1", MAX_CONNECTIONS_PER_ADDRESS + 50):
            assert client.recv(100).startswith(b"HTTP/1.1 503")  # the instrument did not answer


def test_an_incomplete_request_is_aborted_and_an_event_stream_is_not(site, monkeypatch):
    monkeypatch.setattr("pneuforce.web.server.connection.IDLE_TIMEOUT_S", 0.2)
    with site.event_stream() as stream, connections_from(site, "127.0.0.1", 1) as (client,):
        client.sendall(b"POST /api/write HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n")
        client.settimeout(3)
        assert client.recv(100) == b""
        broadcast(site, MESSAGE)
        assert until(stream, "event") == MESSAGE.data


def test_connection_churn_does_not_delay_a_vent(instrument):
    with web_process(socket=str(instrument.path)) as (_, ready):
        wait_for(lambda: instrument.subscriptions, bool)
        with crowd(ready["port"], "be_silent,close_at_once", 400, ["127.0.0.1"]):
            times_s = [time.monotonic()]
            while len(times_s) <= 20:
                assert request(ready["port"], "POST", "/api/vent", {})[0] == 200
                times_s.append(time.monotonic())
    delays_s = [later - earlier for earlier, later in itertools.pairwise(times_s)]
    # The web process and the clients use all processors. A single vent can wait for its turn.
    assert statistics.median(delays_s) < 0.5
    assert max(delays_s) < 5.0


def test_one_stream_too_many_is_rejected_and_can_still_vent(site):
    with contextlib.ExitStack() as browsers:
        for _ in range(MAX_STREAMS):
            browsers.enter_context(site.event_stream())
        status, _, answer = site.get("/api/live")
        assert status == 503
        assert str(MAX_STREAMS) in answer["text"]
        assert site.post("/api/vent", {})[0] == 200
    wait_for(lambda: counts(site)[0], lambda count: count == 0)
    with site.event_stream() as stream:
        assert next(stream)[0] == "link"


def test_a_browser_that_does_not_read_is_disconnected_and_the_others_stay(site):
    long_message = SseMessage("event", {"text": "x" * 50_000})
    with contextlib.closing(socket.socket()) as slow, site.event_stream() as stream:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect(("127.0.0.1", site.port))
        slow.sendall(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        wait_for(lambda: counts(site)[0], lambda count: count == 2)

        def counts_after_message():
            broadcast(site, long_message)
            until(stream, "event")
            return counts(site)

        wait_for(counts_after_message, lambda remaining: remaining == (1, 1))
        assert counts_after_message() == (1, 1)


def test_a_slow_connection_never_shows_old_data_for_long(site, instrument):
    """A connection that is slower than the stream is closed. The page then connects again for new data."""
    with contextlib.closing(socket.socket()) as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        slow.connect(("127.0.0.1", site.port))
        slow.sendall(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        ages_s = list(ages_of_states(slow, instrument, bytes_per_s=2500))
    assert len(ages_s) > 5
    assert max(ages_s) < 5.0
    assert counts(site)[0] == 0


def ages_of_states(connection, instrument, bytes_per_s):
    """Yield the age [s] of each received state until the connection is closed.

    The clock counts the rounds of this loop, so that the ages do not depend on the speed of the computer.
    """
    received = b""
    with contextlib.suppress(ConnectionResetError):
        for now_s in itertools.islice(itertools.count(time.monotonic(), 0.05), 400):
            instrument.send(snapshot(now_s), *(sample(now_s + i / 500) for i in range(25)))
            data = connection.recv(bytes_per_s // 20)
            if not data:
                return
            *lines, received = (received + data).split(b"\n")
            for line in lines:
                if line.startswith(b'data: {"t_s":') and b'"state"' in line:
                    yield now_s - json.loads(line[6:])["t_s"]
            time.sleep(0.05)


def test_a_browser_that_disconnects_is_removed(site):
    with site.event_stream() as stream:
        next(stream)
        assert counts(site)[0] == 1
    wait_for(lambda: counts(site), lambda remaining: remaining == (0, 0))
