"""Tests of requests from other sites, requests from other addresses, and malformed requests."""

import asyncio
import contextlib
import socket

import pytest
from starlette.requests import Request

from pneuforce.web.app import _on_internal_error
from pneuforce.web.server.listener import open_listener
from tests.web.serving import Site


@pytest.mark.parametrize("path", ["/", "/api/about", "/api/live", "/metrics", "/static/main.js"])
def test_a_foreign_host_header_is_rejected(site, path):
    assert site.get(path, Host="evil.example")[0] == 403


@pytest.mark.parametrize("headers", [{"Origin": "http://evil.example"}, {"Origin": "null"}])
def test_the_page_of_another_site_cannot_write(site, instrument, headers):
    assert site.post("/api/vent", {}, **headers)[0] == 403
    assert site.write({"mode": "hold"}, **headers)[0] == 403
    assert instrument.requests == []


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Origin": "http://evil.example"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Sec-Fetch-Site": "same-origin"}, 200),
        ({"Sec-Fetch-Site": "none"}, 200),  # the address was typed into the browser
    ],
    ids=str,
)
def test_the_page_of_another_site_cannot_read_the_api(site, headers, status):
    statuses = {path: site.request("HEAD", path, **headers)[0] for path in ("/api/about", "/api/live")}
    assert statuses == {"/api/about": status, "/api/live": status}
    assert site.get("/api/about", **headers)[0] == status
    assert site.get("/", **headers)[0] == 200  # links from other sites are allowed


def test_a_head_request_for_the_stream_opens_no_stream(site):
    with contextlib.closing(site.connect()) as connection:
        connection.request("HEAD", "/api/live")
        assert connection.getresponse().status == 200
        assert len(site.services.broadcaster) == 0


def test_the_own_page_can_write(site):
    assert site.post("/api/vent", {}, Origin=f"http://127.0.0.1:{site.port}")[0] == 200


def test_a_forged_forwarding_header_does_not_bypass_the_rate_limit(site):
    statuses = [site.log_in(password="wrong", **{"X-Forwarded-For": f"10.0.0.{i}"})[0] for i in range(12)]
    assert 429 in statuses


@pytest.mark.parametrize(
    ("path", "status"), [("/api/about", 200), ("/api/none", 404), ("/static/none", 404), ("/api/write", 405)]
)
def test_each_response_has_the_security_headers(site, path, status):
    actual, headers, _ = site.get(path)
    assert actual == status
    assert headers["content-security-policy"].startswith("default-src 'none'; script-src 'self';")
    assert "unsafe" not in headers["content-security-policy"]
    assert headers["x-content-type-options"] == "nosniff"
    assert "access-control-allow-origin" not in headers


@pytest.mark.parametrize(
    "path", ["/static/../app.py", "/static/%2e%2e/app.py", "/static/..%2fapp.py", "//etc/passwd"]
)
def test_no_file_outside_the_static_folder_is_served(site, path):
    status, _, answer = site.get(path)
    assert status == 404
    assert answer["text"].endswith(".")


def response_to(site, address):
    """Send a request from another address of this machine. Return the start of the response."""
    with contextlib.closing(
        socket.create_connection(("127.0.0.1", site.port), 5, (address, 0))
    ) as connection:
        with contextlib.suppress(ConnectionResetError):
            connection.sendall(b"GET /api/about HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            return connection.recv(100)
        return b""


def test_only_loopback_and_allowed_addresses_can_connect(instrument):
    site = Site(instrument.path, allow=["127.0.0.3/32"])
    responses = {
        address: response_to(site, address)[:12] for address in ("127.0.0.1", "127.0.0.2", "127.0.0.3")
    }
    site.stop()
    assert responses == {"127.0.0.1": b"HTTP/1.1 200", "127.0.0.2": b"", "127.0.0.3": b"HTTP/1.1 200"}


def test_accepted_connections_send_small_segments_without_delay():
    with open_listener("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
        connection, _ = listener.accept()
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


@pytest.mark.parametrize(
    "garbage", [b"\x00" * 100, b"\x16\x03\x01" * 50, b"GET / HTTP/9\r\n\r\n", b"A" * 200_000]
)
def test_garbage_closes_only_its_own_connection(site, garbage):
    connection = socket.create_connection(("127.0.0.1", site.port), 5)
    with contextlib.closing(connection), contextlib.suppress(ConnectionError):
        connection.sendall(garbage)
        while connection.recv(1000):
            pass
    assert site.get("/api/about")[0] == 200


def status_line(site, request):
    """Send raw bytes. Return the first line of the response."""
    with socket.create_connection(("127.0.0.1", site.port), 5) as connection:
        connection.sendall(request + b"\r\n\r\n")
        return connection.makefile("rb").readline().decode().strip()


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
        (b"POST /api/vent HTTP/1.1" + HOST + b"\r\nContent-Length: 9", 200),  # the body never arrives
    ],
    ids=lambda value: str(value)[:40],
)
def test_unusual_requests_get_a_defined_status(site, request_, status):
    assert status_line(site, request_).split()[1] == str(status)


def test_the_line_about_an_internal_error_contains_no_control_characters(caplog):
    """The host reads the lines of the web process. A line break in a path would forge a line."""
    path = "/a\nrig vented\x1b[2J" + "x" * 1000
    asyncio.run(_on_internal_error(Request({"type": "http", "path": path, "headers": []}), ValueError()))
    (line,) = caplog.messages
    assert line.isprintable()
    assert len(line) < 300
