"""Many browsers, slow ones, and connections that say nothing."""

import contextlib
import itertools
import json
import socket
import subprocess
import sys
import time

from page.crowd import MOST_CONNECTIONS, MOST_OF_ONE
from page.streams import MOST_STREAMS, Message
from tests.page.entries import measured, snapshot
from tests.page.process import ask, page
from tests.page.serving import Site, until
from tests.system.waiting import wait_for


def send(site, message):
    """Let all that look have this now."""
    site.parts.streams.send([message], time.monotonic())


def test_two_hundred_that_say_nothing_keep_nobody_from_venting(site):
    with contextlib.ExitStack() as crowd:
        for _ in range(200):
            crowd.enter_context(contextlib.closing(socket.create_connection(("127.0.0.1", site.port))))
        assert site.post("/api/vent", {})[0] == 200


@contextlib.contextmanager
def far_ends(site, address, count):
    """So many connections from an address of this machine."""
    with contextlib.ExitStack() as crowd:
        yield [
            crowd.enter_context(
                contextlib.closing(socket.create_connection(("127.0.0.1", site.port), 5, (address, 0)))
            )
            for _ in range(count)
        ]


def test_there_are_never_more_connections_than_there_is_room_for(station):
    site = Site(station.path, allow=["127.0.0.0/8"])
    more = MOST_CONNECTIONS - MOST_OF_ONE + 50
    with site.live() as stream, far_ends(site, "127.0.0.2", MOST_OF_ONE), far_ends(site, "127.0.0.3", more):
        wait_for(lambda: len(site.parts.crowd), lambda many: many == MOST_CONNECTIONS)
        assert site.post("/api/vent", {})[0] == 200
        assert next(stream)[0] == "link"  # the oldest of all, and it stays
        send(site, Message("event", {"text": "still here"}))
        assert until(stream, "event") == {"text": "still here"}
    site.end()


def test_an_address_that_takes_too_much_makes_room_for_itself(station):
    site = Site(station.path, allow=["127.0.0.0/8"])
    with far_ends(site, "127.0.0.2", 1) as (quiet,), far_ends(site, "127.0.0.3", MOST_OF_ONE + 50) as many:
        wait_for(lambda: len(site.parts.crowd), lambda count: count == MOST_OF_ONE + 1)
        many[0].settimeout(5)
        assert many[0].recv(1) == b""
        quiet.sendall(b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert quiet.recv(100).startswith(b"HTTP/1.1 200")
    site.end()


def test_who_has_asked_is_answered_whoever_comes_after(site, station):
    station.answers = False
    with far_ends(site, "127.0.0.1", 1) as (asker,):
        asker.sendall(b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\n\r\n")
        with far_ends(site, "127.0.0.1", MOST_OF_ONE + 50):
            assert asker.recv(100).startswith(b"HTTP/1.1 503")  # the instrument said nothing


def test_who_never_ends_his_request_is_cut_off_and_who_looks_is_not(site, monkeypatch):
    monkeypatch.setattr("page.connection.PATIENCE_S", 0.2)
    with site.live() as stream, far_ends(site, "127.0.0.1", 1) as (asker,):
        asker.sendall(b"POST /api/write HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n")
        asker.settimeout(3)
        assert asker.recv(100) == b""
        send(site, Message("event", {"text": "still here"}))
        assert until(stream, "event") == {"text": "still here"}


def test_connections_that_come_and_go_do_not_keep_a_vent_waiting(station):
    with page(socket=str(station.path)) as (_, ready):
        wait_for(lambda: station.wanted, bool)
        churn = [sys.executable, "-m", "tests.page.churn", str(ready["page"])]
        with subprocess.Popen(churn, stdout=subprocess.PIPE) as crowd:
            crowd.stdout.readline()
            asked_s = [time.monotonic()]
            while len(asked_s) <= 20:
                assert ask(ready["page"], "POST", "/api/vent", {})[0] == 200
                asked_s.append(time.monotonic())
            crowd.kill()
    assert max(later - sooner for sooner, later in itertools.pairwise(asked_s)) < 1.0


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
            send(site, much)
            until(stream, "event")
            return len(site.parts.streams), len(site.parts.crowd)

        wait_for(left, lambda left: left == (1, 1))
        assert left() == (1, 1)


def test_a_line_that_is_slow_brings_nothing_old_for_long(site, station):
    """It takes less than it is told; the page goes on, so that what it begins with is new."""
    with contextlib.closing(socket.socket()) as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        slow.connect(("127.0.0.1", site.port))
        slow.sendall(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        ages_s = list(ages_of_states(slow, station, bytes_per_s=2500))
    assert len(ages_s) > 5
    assert max(ages_s) < 5.0
    assert len(site.parts.streams) == 0


def ages_of_states(line, station, bytes_per_s):
    """How old each state is that comes, until the line is cut off."""
    taken, begun_s, now_s = b"", time.monotonic(), 0.0
    with contextlib.suppress(ConnectionResetError):
        while now_s < begun_s + 20.0:
            now_s = time.monotonic()
            station.say(snapshot(now_s), *(measured(now_s + i / 500) for i in range(25)))
            more = line.recv(bytes_per_s // 20)
            if not more:
                return
            *whole, taken = (taken + more).split(b"\n")
            for text in whole:
                if text.startswith(b'data: {"t_s":') and b'"state"' in text:
                    yield now_s - json.loads(text[6:])["t_s"]
            time.sleep(0.05)


def test_a_browser_that_leaves_is_forgotten(site):
    with site.live() as stream:
        next(stream)
        assert len(site.parts.streams) == 1
    wait_for(lambda: (len(site.parts.streams), len(site.parts.crowd)), lambda left: left == (0, 0))
