"""Many browsers, slow ones, and connections that say nothing."""

import contextlib
import socket

from page.crowd import MOST_CONNECTIONS
from page.streams import MOST_STREAMS, Message
from tests.page.serving import until
from tests.system.waiting import wait_for


def test_two_hundred_that_say_nothing_keep_nobody_from_venting(site):
    with contextlib.ExitStack() as crowd:
        for _ in range(200):
            crowd.enter_context(contextlib.closing(socket.create_connection(("127.0.0.1", site.port))))
        assert site.post("/api/vent", {})[0] == 200


def test_there_are_never_more_connections_than_there_is_room_for(site):
    with site.live() as stream, contextlib.ExitStack() as crowd:
        for _ in range(MOST_CONNECTIONS + 50):
            crowd.enter_context(contextlib.closing(socket.create_connection(("127.0.0.1", site.port))))
        wait_for(lambda: len(site.parts.crowd), lambda many: many == MOST_CONNECTIONS)
        assert site.post("/api/vent", {})[0] == 200
        assert next(stream)[0] == "link"  # the oldest of all, and it stays
        site.parts.streams.send([Message("event", {"text": "still here"})])
        assert until(stream, "event") == {"text": "still here"}


def test_one_browser_too_many_is_told_so_and_can_still_vent(site):
    with contextlib.ExitStack() as browsers:
        for _ in range(MOST_STREAMS):
            browsers.enter_context(site.live())
        status, _, answer = site.get("/api/live")
        assert status == 503
        assert "close one" in answer["text"]
        assert site.post("/api/vent", {})[0] == 200
    wait_for(lambda: len(site.parts.streams), lambda many: many == 0)
    with site.live() as stream:
        assert next(stream)[0] == "link"


def test_a_browser_that_does_not_read_is_cut_off_and_the_others_read_on(site):
    much = Message("event", {"text": "x" * 50_000})
    with contextlib.closing(socket.socket()) as slow, site.live() as stream:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect(("127.0.0.1", site.port))
        slow.sendall(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        wait_for(lambda: len(site.parts.streams), lambda many: many == 2)

        def left():
            site.parts.streams.send([much])
            until(stream, "event")
            return len(site.parts.streams), len(site.parts.crowd)

        wait_for(left, lambda left: left == (1, 1))
        assert left() == (1, 1)


def test_a_browser_that_leaves_is_forgotten(site):
    with site.live() as stream:
        next(stream)
        assert len(site.parts.streams) == 1
    wait_for(lambda: (len(site.parts.streams), len(site.parts.crowd)), lambda left: left == (0, 0))
