"""Tests of the web server over HTTPS: handshakes, plain HTTP at the same port, renewal."""

import contextlib
import http.client
import json
import logging
import socket
import ssl
import subprocess
import time

import pytest

from pneuforce.instrument.stream.entry import EntryKind, json_entry
from pneuforce.support.throttle import RateLimitedLogger
from pneuforce.web.app import STATIC
from pneuforce.web.server import https_connection
from pneuforce.web.server.connection_limiter import MAX_CONNECTIONS_PER_ADDRESS
from tests.registers.modbus_security.serving import Pki
from tests.system.waiting import wait_for
from tests.web.entries import header
from tests.web.serving import FakeInstrument, Site, read_events, send_until_received
from tests.web.users import OPERATOR, PASSWORD

VENT = b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.fixture(scope="module")
def pki(tmp_path_factory):
    return Pki(tmp_path_factory.mktemp("pki"))


@pytest.fixture(scope="module")
def instrument(tmp_path_factory):
    instrument = FakeInstrument(tmp_path_factory.mktemp("instrument") / "pneuforce.sock")
    yield instrument
    instrument.close()


@pytest.fixture(scope="module")
def site(instrument, pki):
    site = Site(instrument.path, **pki.own)
    wait_for(lambda: instrument.subscriptions, bool)
    facts = {"configuration": {"rdt": {"enabled": True}}, "serial_number": 7}
    instrument.send(json_entry(EntryKind.HEADER, 0.0, header().json_body | facts))
    wait_for(lambda: site.services.feed.header, bool)
    yield site
    site.stop()


def connect(site, pki, **options):
    """Return an HTTPS connection that verifies the certificate."""
    return contextlib.closing(
        http.client.HTTPSConnection("localhost", site.port, timeout=10, context=pki.context(), **options)
    )


def request(site, pki, method, path, body=None, **headers):
    """Send a request over HTTPS. Return status and headers and body."""
    with connect(site, pki) as connection:
        connection.request(method, path, body and json.dumps(body), headers)
        response = connection.getresponse()
        return response.status, response.headers, response.read()


def s_client(site, *options):
    command = ["openssl", "s_client", "-connect", f"127.0.0.1:{site.port}", *options]
    return subprocess.run(command, input=b"", capture_output=True, timeout=15, check=False)


# ---- what the page serves over HTTPS


@pytest.mark.parametrize("path", ["/", "/metrics", "/api/about", "/static/vendor/uPlot.esm.js", "/absent"])
def test_each_answer_demands_https_for_the_future(site, pki, path):
    _, headers, body = request(site, pki, "GET", path)
    assert headers["Strict-Transport-Security"].startswith("max-age=")
    assert body


def test_curl_sees_the_same_file_as_over_http(site, pki, tmp_path):
    url = f"https://localhost:{site.port}/static/vendor/uPlot.esm.js"
    words = ["curl", "-sS", "--cacert", str(pki.folder / "ca.pem"), "-D", str(tmp_path / "head"), url]
    done = subprocess.run(words, capture_output=True, timeout=15, check=True)
    assert done.stdout == (STATIC / "vendor/uPlot.esm.js").read_bytes()
    assert "strict-transport-security: max-age=" in (tmp_path / "head").read_text().lower()


def test_the_event_stream_and_a_vent_use_one_certificate(site, pki, instrument):
    with connect(site, pki) as stream:
        stream.request("GET", "/api/live")
        assert next(read_events(stream.getresponse()))[0] == "link"
        assert request(site, pki, "POST", "/api/vent", {})[0] == 200
    assert instrument.requests[-1] == {"mode": "vent"}
    assert instrument.addresses[-1] == "127.0.0.1"


def test_the_cookie_of_a_login_is_sent_over_https_only(site, pki):
    user = {"name": OPERATOR, "password": PASSWORD}
    _, headers, _ = request(site, pki, "POST", "/api/login", user)
    cookies = headers.get_all("Set-Cookie")
    assert len(cookies) == 2
    assert all("secure" in cookie.lower().split("; ") for cookie in cookies)


def test_a_page_that_was_sent_without_encryption_cannot_write(site, pki):
    origins = {"https": 200, "http": 403}
    statuses = {
        scheme: request(site, pki, "POST", "/api/vent", {}, Origin=f"{scheme}://localhost:{site.port}")[0]
        for scheme in origins
    }
    assert statuses == origins


# ---- handshakes


@pytest.mark.parametrize("version", ["-tls1_2", "-tls1_3"])
def test_both_versions_of_tls_are_accepted(site, pki, version):
    done = s_client(site, version, "-CAfile", pki.folder / "ca.pem", "-verify_return_error")
    assert done.returncode == 0
    assert b"Verify return code: 0" in done.stdout


@pytest.mark.parametrize(
    "options",
    [
        ["-tls1_1", "-cipher", "DEFAULT@SECLEVEL=0"],
        ["-tls1_2", "-cipher", "AES128-SHA256:AES256-GCM-SHA384"],
        ["-tls1_2", "-cipher", "ECDHE-ECDSA-AES256-SHA384"],
    ],
)
def test_old_protocols_and_weak_ciphers_are_rejected_with_an_alert(site, options):
    done = s_client(site, *options)
    assert done.returncode != 0
    assert b"alert" in done.stderr
    assert b"Cipher is (NONE)" in done.stdout


def test_the_log_names_a_client_that_does_not_know_the_authority(site, caplog, monkeypatch):
    monkeypatch.setattr(https_connection, "_log", RateLimitedLogger(logging.getLogger("pneuforce"), 60.0))
    with (
        pytest.raises(ssl.SSLCertVerificationError),
        socket.create_connection(("127.0.0.1", site.port)) as raw,
    ):
        ssl.create_default_context().wrap_socket(raw, server_hostname="localhost")
    wait_for(
        lambda: caplog.messages, lambda found: any("127.0.0.1" in m and "unknown ca" in m for m in found)
    )


def test_a_handshake_that_does_not_end_is_closed(site, monkeypatch):
    monkeypatch.setattr(https_connection, "HANDSHAKE_TIMEOUT_S", 0.2)
    for first in (b"", b"\x16\x03\x01\x02\x00"):
        with socket.create_connection(("127.0.0.1", site.port), 5) as client:
            client.sendall(first)
            with contextlib.suppress(ConnectionResetError):
                assert client.recv(100) == b""


@pytest.mark.parametrize("first", [b"", b"\x16\x03\x01\x02\x00\x01"])
def test_handshakes_that_do_not_end_prevent_no_vent(site, pki, first):
    with contextlib.ExitStack() as connections:
        for _ in range(MAX_CONNECTIONS_PER_ADDRESS + 50):
            client = connections.enter_context(socket.create_connection(("127.0.0.1", site.port), 5))
            client.sendall(first)
        assert len(site.services.limiter) <= MAX_CONNECTIONS_PER_ADDRESS
        assert request(site, pki, "POST", "/api/vent", {})[0] == 200
    wait_for(lambda: len(site.services.limiter), lambda count: count == 0)


# ---- plain HTTP at the same port


@pytest.mark.parametrize("path", ["/", "/api/about", "/metrics", "/static/overview.css?a=b", "/api/live"])
def test_a_plain_request_is_redirected(site, path):
    status, headers, _ = site.get(path, Host="localhost:8443")
    assert (status, headers["Location"]) == (307, f"https://localhost:8443{path}")
    assert "Strict-Transport-Security" not in headers


def test_a_plain_write_is_rejected_and_says_where_to_send_it(site, instrument):
    count = len(instrument.requests)
    status, _, answer = site.write({"setpoint_requested_kpa": 8.0}, user=None)
    assert status == 403
    assert f"https://127.0.0.1:{site.port}/api/write" in answer["text"]
    assert len(instrument.requests) == count


def test_a_redirection_never_leads_to_another_host(site):
    assert site.get("/", Host="evil.example")[0] == 403
    with socket.create_connection(("127.0.0.1", site.port), 5) as client:
        client.sendall(b"GET http://evil.example/ HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert b"\r\nlocation: https://localhost/\r\n" in client.recv(2000).lower()


def test_clients_of_ati_sensors_and_vents_need_no_tls(site, instrument):
    status, _, body = site.get("/netftapi2.xml")
    assert (status, b"<cfgcpf>" in body) == (200, True)
    assert site.post("/api/vent", {})[0] == 200
    assert instrument.requests[-1] == {"mode": "vent"}


def test_a_monitor_gets_the_same_health_with_and_without_tls(site, pki, instrument):
    for bits, expected in ((["stale", "link_lost"], 503), (["vented"], 200)):
        send_until_received(instrument, site, {"status": bits})
        _, headers, body = wait_for(
            lambda: request(site, pki, "GET", "/health"),
            lambda answer, expected=expected: answer[0] == expected,
        )
        assert headers["Strict-Transport-Security"].startswith("max-age=")
        assert json.loads(body)["ok"] == (expected == 200)
        plain_status, plain_headers, plain = site.get("/health")
        assert (plain_status, plain) == (expected, json.loads(body))
        assert "Strict-Transport-Security" not in plain_headers
        assert site.request("HEAD", "/health")[0] == expected


def test_bytes_that_are_neither_tls_nor_http_are_answered_and_closed(site):
    with socket.create_connection(("127.0.0.1", site.port), 5) as client:
        client.sendall(b"\x80\x2e\x01\x03\x01\r\n\r\n")
        assert client.recv(100).startswith(b"HTTP/1.1 400")


# ---- renewal


def test_a_renewed_certificate_is_used_and_open_connections_stay(site, pki):

    def serial_number():
        with socket.create_connection(("127.0.0.1", site.port), 5) as raw:
            return pki.context().wrap_socket(raw, server_hostname="localhost").getpeercert()["serialNumber"]

    before = serial_number()
    with connect(site, pki) as stream:
        stream.request("GET", "/api/live")
        events = read_events(stream.getresponse())
        (pki.folder / "instrument.key").write_bytes(b"half a file")
        assert not site.services.tls.renew(time.time())
        assert serial_number() == before
        pki.renew_instrument()
        assert site.services.tls.renew(time.time()) == {"certificate", "key"}
        assert serial_number() != before
        assert next(events)[0] == "link"
