"""Tests of the places for event streams, with real sockets."""

import contextlib

import pytest

from pneuforce.web.event_stream import MAX_STREAMS
from tests.system.waiting import wait_for
from tests.web.serving import Site

OTHER_ADDRESS = "127.0.0.2"


@pytest.fixture
def site(instrument):
    site = Site(instrument.path, allow=["127.0.0.0/8"])
    wait_for(lambda: instrument.subscriptions, bool)
    yield site
    site.stop()


@pytest.fixture
def streams(site):
    """Open all streams from one address that has not logged in."""
    with contextlib.ExitStack() as browsers:
        yield [browsers.enter_context(site.event_stream(OTHER_ADDRESS)) for _ in range(MAX_STREAMS)]


def test_one_address_cannot_keep_all_streams(site, streams):
    with site.event_stream() as stream:
        assert next(stream)[0] == "link"
        assert len(site.services.broadcaster) == MAX_STREAMS
        list(streams[-1])  # ends, because the newest stream of the other address was closed
        assert next(streams[0])[0] == "link"


def test_a_browser_that_has_logged_in_gets_a_stream_at_the_same_address(site, streams):
    with contextlib.closing(site.connect(address=OTHER_ADDRESS)) as connection:
        connection.request("GET", "/api/live")
        assert connection.getresponse().status == 503
    with site.event_stream(OTHER_ADDRESS, **site.cookies()) as stream:
        assert next(stream)[0] == "link"
        assert len(site.services.broadcaster) == MAX_STREAMS


def test_the_connection_of_a_closed_stream_can_be_closed_for_new_connections(site, streams):
    with site.event_stream():
        list(streams[-1])
        connections = site.services.limiter._queues[OTHER_ADDRESS]
        wait_for(lambda: len(list(connections.candidates())), (1).__eq__)
