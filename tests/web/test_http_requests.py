"""Requests that come from elsewhere, or from nothing that speaks HTTP as it should."""

import contextlib
import socket

import pytest

from page.door import door
from tests.page.serving import Site


@pytest.mark.parametrize("path", ["/", "/api/about", "/api/live", "/static/main.js"])
def test_another_name_in_the_host_header_is_another_site(site, path):
    assert site.get(path, Host="evil.example")[0] == 403


@pytest.mark.parametrize("headers", [{"Origin": "http://evil.example"}, {"Origin": "null"}])
def test_another_sites_page_can_order_nothing(site, station, headers):
    assert site.post("/api/vent", {}, **headers)[0] == 403
    assert site.write({"mode": "hold"}, **headers)[0] == 403
    assert station.asked == []


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Origin": "http://evil.example"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Sec-Fetch-Site": "same-origin"}, 200),
        ({"Sec-Fetch-Site": "none"}, 200),  # typed into the browser
    ],
    ids=str,
)
def test_another_sites_page_cannot_even_look(site, headers, status):
    stati = {path: site.ask("HEAD", path, **headers)[0] for path in ("/api/about", "/api/live")}
    assert stati == {"/api/about": status, "/api/live": status}
    assert site.get("/api/about", **headers)[0] == status
    assert site.get("/", **headers)[0] == 200  # a link may lead here


def test_who_asks_for_the_head_of_the_stream_takes_no_place(site):
    with contextlib.closing(site.connect()) as kept:
        kept.request("HEAD", "/api/live")
        assert kept.getresponse().status == 200
        assert len(site.parts.streams) == 0


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
    with door("127.0.0.1", 0) as bound, socket.create_connection(bound.getsockname()):
        accepted, _ = bound.accept()
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


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
