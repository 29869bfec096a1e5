"""The page as browsers, curl and worse meet it: real sockets, and an instrument that the tests speak for."""

import contextlib
import socket
import time

import pytest

from page.__main__ import listener
from page.crowd import MOST_CONNECTIONS
from page.streams import MOST_STREAMS, Message
from registers.can.frames import FORCE, encode
from registers.map import BLOCKS, REGISTERS
from registers.modbus.bank import Bank
from tests.page.entries import begin, health, measured, real_snapshot, snapshot
from tests.page.serving import Site, Station, until
from tests.system.waiting import wait_for


@pytest.fixture
def station(tmp_path):
    station = Station(tmp_path / "pneuforce.sock")
    yield station
    station.close()


@pytest.fixture
def site(station):
    site = Site(station.path)
    wait_for(lambda: station.wanted, bool)
    station.say(begin())
    yield site
    site.end()


def say_again(station, site, facts):
    """Let the instrument say this, and go on saying it, until the page has it."""

    def said():
        station.say(snapshot(time.monotonic(), **facts))
        return site.parts.view.snapshot

    wait_for(said, lambda known: known is not None)


def test_it_wants_to_be_a_page(site, station):
    assert station.wanted == [{"want": "page"}]


def test_it_says_what_it_is_about(site):
    status, _, about = site.get("/api/about")
    assert status == 200
    assert (about["version"], about["replay"]) == ("1.2", "")
    assert about["writable"] is True
    assert {r["name"] for r in about["registers"]} == {r.name for r in REGISTERS}
    assert about["faults"]["5"]["name"] == "burst"
    assert all(about["faults"][code].keys() == {"name", "what", "do"} for code in about["faults"])
    assert about["status"]["burst"]["bit"] == 13


def test_a_replay_is_said_to_be_one(site, station):
    station.say(begin(replay="tuesday.pfr"))
    wait_for(lambda: site.get("/api/about")[2]["replay"], lambda name: name == "tuesday.pfr")


def test_a_browser_that_connects_knows_at_once_what_there_is(site, station):
    say_again(station, site, {"state": "holding"})
    with site.live() as stream:
        assert [name for name, _ in (next(stream) for _ in range(4))] == [
            "link",
            "state",
            "samples",
            "contacts",
        ]


def test_the_words_are_those_that_modbus_would_answer(site, station):
    shown, plain = real_snapshot()
    say_again(station, site, plain)
    _, _, answer = site.get("/api/registers")
    for (first, last), block in zip(BLOCKS, answer["blocks"], strict=True):
        words = Bank().reader(first, last - first + 1)(shown)
        assert block["address"] == first
        assert b"".join(word.to_bytes(2, "big") for word in block["words"]) == words


def test_frames_have_their_values_by_name_and_nonsense_has_none(site, station):
    shown, plain = real_snapshot()
    data = encode(FORCE, shown, counter=3).hex(" ")
    seen = [
        {"id": 0x185, "name": name, "data": data_, "count": 1, "age_s": 0.0, "out": True}
        for name, data_ in [("Force", data), ("Force", "00"), ("", data), ("State", "zz")]
    ]
    say_again(station, site, plain)
    station.say(health(time.monotonic(), can={"frames": seen}))
    wait_for(lambda: site.parts.view.health, bool)
    say_again(station, site, plain)
    _, _, answer = site.get("/api/frames")
    assert answer["frames"][0]["values"]["counter"] == 3
    assert answer["frames"][0]["values"]["pressure"] == pytest.approx(8.0, abs=0.1)
    assert [frame["values"] for frame in answer["frames"][1:]] == [{}, {}, {}]


@pytest.mark.parametrize("path", ["/api/registers", "/api/frames"])
def test_without_an_instrument_there_are_no_numbers(site, path):
    status, _, answer = site.get(path)
    assert status == 503
    assert answer["text"].endswith(".")


# ---- ordering


def test_a_vent_needs_no_token(site, station):
    assert site.post("/api/vent", {})[2]["refusal"] == "none"
    assert station.asked == [{"mode": "vent"}]


@pytest.mark.parametrize("body", ["", "{", "x" * 100_000])
def test_a_vent_is_a_vent_whatever_comes_with_it(site, station, body):
    assert site.post("/api/vent", body)[0] == 200
    assert station.asked == [{"mode": "vent"}]


def test_a_vent_that_is_not_answered_is_said_to_have_failed(site, station):
    station.answers = False
    status, _, answer = site.post("/api/vent", {})
    assert status == 503
    assert "stop switch" in answer["text"]


def test_a_vent_without_an_instrument_fails_at_once_and_says_so(tmp_path):
    site = Site(tmp_path / "nobody.sock")
    status, _, answer = site.post("/api/vent", {})
    site.end()
    assert status == 503
    assert "stop switch" in answer["text"]


def test_a_write_reaches_the_instrument_in_its_own_units(site, station):
    status, _, answer = site.write({"setpoint_requested": 6.5, "mode": "hold"})
    assert (status, answer) == (200, {"refusal": "none", "text": "Accepted."})
    assert station.asked == [{"setpoint_requested": 6.5, "mode": "hold"}]


def test_a_refusal_is_said_in_a_sentence(site, station):
    station.refusal = "not_zeroed"
    status, _, answer = site.write({"mode": "hold"})
    assert (status, answer["refusal"]) == (200, "not_zeroed")
    assert answer["text"].startswith("The sensor has no zero")


def test_a_wrong_token_writes_nothing_and_is_soon_not_looked_at(site, station):
    stati = [site.write({"mode": "hold"}, token="wrong")[0] for _ in range(12)]
    assert stati == sorted(stati)
    assert set(stati) == {401, 429}
    assert site.write({"mode": "hold"})[0] == 429
    assert station.asked == []
    assert site.post("/api/vent", {})[0] == 200


def test_a_token_can_be_tried_without_writing(site, station):
    assert site.post("/api/token", {"token": "correct-horse-battery"})[0] == 200
    assert site.post("/api/token", {"token": "wrong"})[0] == 401
    assert station.asked == []


def test_without_a_configured_token_nobody_writes_and_everybody_vents(station):
    site = Site(station.path, token="")
    wait_for(lambda: station.wanted, bool)
    assert site.get("/api/about")[2]["writable"] is False
    assert site.write({"mode": "hold"}, token="")[0] == 401
    assert site.post("/api/vent", {})[0] == 200
    site.end()
    assert station.asked == [{"mode": "vent"}]


TOKEN = '"token": "correct-horse-battery"'


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ("", 400),
        ("[]", 400),
        ("null", 400),
        ("{", 400),
        ("\xff\xfe", 400),
        ("[" * 10_000, 400),
        ("{" + TOKEN + "}", 400),
        ("{" + TOKEN + ', "values": []}', 400),
        ("{" + TOKEN + ', "values": {}}', 400),
        ("{" + TOKEN + ', "values": {"no_such": 1}}', 400),
        ("{" + TOKEN + ', "values": {"\\ud800": 1}}', 400),
        ("{" + TOKEN + ', "values": {"force": 1}}', 400),
        ("{" + TOKEN + ', "values": {"mode": NaN}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": NaN}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": 1e999}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": 1' + "0" * 400 + "}}", 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": 1' + "0" * 5000 + "}}", 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": 13}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": "8"}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": true}}', 400),
        ("{" + TOKEN + ', "values": {"setpoint_requested": [8]}}', 400),
        ("{" + TOKEN + ', "values": {"mode": "inflate"}}', 400),
        ("{" + TOKEN + ', "values": {"mode": {"a": 1}}}', 400),
        ('{"values": {"mode": "hold"}}', 401),
        ('{"token": "\\ud800", "values": {"mode": "hold"}}', 401),
        ('{"token": 5, "values": {"mode": "hold"}}', 401),
        ("x" * 10_000_000, 413),
    ],
    ids=lambda value: str(value)[:40],
)
def test_what_cannot_be_asked_is_refused_in_a_sentence_and_asks_nothing(site, station, body, status):
    told, _, answer = site.post("/api/write", body)
    assert told == status
    assert answer["text"].endswith(".")
    assert len(answer["text"]) < 300
    assert "Traceback" not in answer["text"]
    assert station.asked == []


# ---- whose requests


@pytest.mark.parametrize("path", ["/", "/api/about", "/api/live", "/static/main.js"])
def test_another_name_in_the_host_header_is_another_site(site, path):
    assert site.get(path, Host="evil.example")[0] == 403


@pytest.mark.parametrize("headers", [{"Origin": "http://evil.example"}, {"Origin": "null"}])
def test_another_sites_page_can_order_nothing(site, station, headers):
    assert site.post("/api/vent", {}, **headers)[0] == 403
    assert site.write({"mode": "hold"}, **headers)[0] == 403
    assert station.asked == []


def test_our_own_page_can_order(site):
    assert site.post("/api/vent", {}, Origin=f"http://127.0.0.1:{site.port}")[0] == 200


def test_a_forged_forwarding_header_is_nobodys_address(site):
    stati = [
        site.post("/api/token", {"token": "wrong"}, **{"X-Forwarded-For": f"10.0.0.{i}"})[0]
        for i in range(12)
    ]
    assert 429 in stati


@pytest.mark.parametrize(
    ("path", "status"), [("/api/about", 200), ("/api/none", 404), ("/static/none", 404), ("/api/write", 405)]
)
def test_each_answer_restricts_what_the_browser_may_load(site, path, status):
    told, headers, _ = site.get(path)
    assert told == status
    assert headers["content-security-policy"].startswith("default-src 'none'; script-src 'self';")
    assert "unsafe" not in headers["content-security-policy"]
    assert headers["x-content-type-options"] == "nosniff"
    assert "access-control-allow-origin" not in headers


@pytest.mark.parametrize(
    "path", ["/static/../app.py", "/static/%2e%2e/app.py", "/static/..%2fapp.py", "//etc/passwd"]
)
def test_no_file_but_the_pages_own_is_given(site, path):
    status, _, answer = site.get(path)
    assert status == 404
    assert answer["text"].endswith(".")


def far_end(site, address):
    """A connection from another address of this machine; what it is answered."""
    with contextlib.closing(socket.create_connection(("127.0.0.1", site.port), 5, (address, 0))) as far:
        with contextlib.suppress(ConnectionResetError):
            far.sendall(b"GET /api/about HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            return far.recv(100)
        return b""


def test_only_this_machine_and_who_is_listed_may_connect(station):
    site = Site(station.path, allow=["127.0.0.3/32"])
    answers = {address: far_end(site, address)[:12] for address in ("127.0.0.1", "127.0.0.2", "127.0.0.3")}
    site.end()
    assert answers == {"127.0.0.1": b"HTTP/1.1 200", "127.0.0.2": b"", "127.0.0.3": b"HTTP/1.1 200"}


def test_no_part_of_an_answer_waits_for_the_part_before_to_be_acknowledged():
    with listener("127.0.0.1", 0) as bound, socket.create_connection(bound.getsockname()):
        accepted, _ = bound.accept()
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


# ---- many, slow and malformed


@pytest.mark.parametrize(
    "garbage", [b"\x00" * 100, b"\x16\x03\x01" * 50, b"GET / HTTP/9\r\n\r\n", b"A" * 200_000]
)
def test_garbage_costs_its_own_connection(site, garbage):
    far = socket.create_connection(("127.0.0.1", site.port), 5)
    with contextlib.closing(far), contextlib.suppress(ConnectionError):
        far.sendall(garbage)
        while far.recv(1000):
            pass
    assert site.get("/api/about")[0] == 200


def said(site, request, end=b"\r\n\r\n"):
    """The first line of what is answered to these bytes."""
    with socket.create_connection(("127.0.0.1", site.port), 5) as far:
        far.sendall(request + end)
        return far.makefile("rb").readline().decode().strip()


HOST = b"\r\nHost: localhost"


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"GET /api/about HTTP/1.0", 403),
        (b"GET /api/about HTTP/1.1", 400),
        (b"GET /api/about HTTP/1.1" + HOST + HOST, 400),
        (b"GET http://evil.example/api/about HTTP/1.1" + HOST, 404),
        (b"CONNECT evil.example:80 HTTP/1.1" + HOST, 404),
        (b"OPTIONS /api/write HTTP/1.1" + HOST + b"\r\nOrigin: http://evil.example", 403),
        (b"DELETE /api/about HTTP/1.1" + HOST, 405),
        (b"GET /static/%00 HTTP/1.1" + HOST, 404),
        (b"GET /static/%ff HTTP/1.1" + HOST, 404),
        (b"GET /static/" + b"a" * 5000 + b" HTTP/1.1" + HOST, 404),
        (b"POST /api/vent HTTP/1.1" + HOST + b"\r\nContent-Length: 9", 200),  # whose body never comes
    ],
    ids=lambda value: str(value)[:40],
)
def test_odd_requests_have_their_answers(site, request_, status):
    assert said(site, request_).split()[1] == str(status)


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


# ---- an instrument that goes


def test_an_instrument_that_goes_is_told_and_comes_back(site, station):
    with site.live() as stream:
        until(stream, "link")
        say_again(station, site, {"state": "holding"})
        assert until(stream, "link", lambda link: link["up"]) == {"up": True, "why": ""}
        station.close()
        assert until(stream, "link")["up"] is False
        assert site.get("/api/registers")[0] == 503
        station.open()
        wait_for(lambda: station.wanted, lambda wanted: len(wanted) == 2)
        station.say(begin())
        say_again(station, site, {"state": "vented"})
        assert until(stream, "link")["up"] is True
        assert until(stream, "state")["state"] == "vented"


def test_an_instrument_that_speaks_nonsense_is_left_and_tried_again(site, station):
    station.guests[-1].sendall(b"\xff" * 100)
    wait_for(lambda: station.wanted, lambda wanted: len(wanted) == 2)
    assert "another version" in site.parts.view.why


def test_thousands_of_samples_a_second_are_read_while_browsers_do_not(site, station):
    """The host cuts off who is 8 MB behind: the page must read on, whatever its browsers do."""
    with contextlib.closing(socket.create_connection(("127.0.0.1", site.port))) as slow:
        slow.sendall(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        for second in range(20):
            station.say(*(measured(second + i / 500) for i in range(500)))
        now_s = time.monotonic()
        station.say(snapshot(now_s))
        wait_for(lambda: site.parts.view.snapshot, lambda known: known is not None)
