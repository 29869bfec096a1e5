"""Tests of the TLS gateway with real sockets, certificates and clients."""

import re
import socket
import ssl
import subprocess
import time
from contextlib import suppress
from datetime import timedelta

import pytest
from pymodbus.client import ModbusTlsClient

from pneuforce.instrument.commissioning.certificates import new_authority, new_client, revocation_list
from pneuforce.registers.modbus.client import ModbusClient, NoAnswerError
from pneuforce.registers.modbus.client_context import ClientFiles, client_context, handshake_problem
from pneuforce.registers.modbus_security import gateway as gateway_module
from pneuforce.registers.modbus_security.__main__ import heartbeat
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import eventually, read_answer, read_until_closed, send_request
from tests.registers.modbus_security.serving import Pki, serving

VENT = "0001 0000 0006 01 06 0204 0000"
HOLD = "0001 0000 0006 01 06 0204 0001"
SETPOINT = "0001 0000 0006 01 06 0220 1388"
SETPOINT_AND_LIMIT = "0001 0000 000b 01 10 0220 0002 04 1388 1388"
UNKNOWN_ADDRESS = "0001 0000 0006 01 06 0300 0000"
FORCE = "0001 0000 0006 01 04 0000 0002"


@pytest.fixture(scope="module")
def pki(tmp_path_factory):
    pki = Pki(tmp_path_factory.mktemp("pki"))
    for name, role in {
        "plc": "operator",
        "hmi": "viewer",
        "setter": "setter",
        "unknown": "admin",
        "nobody": "",
    }.items():
        pki.client(name, role)
    pki.client("expired", "operator", days=1, age_days=30)
    pki.client("future", "operator", age_days=-10)
    other = new_authority("test authority", pki.now)  # the same name, another key
    pki.write("other_ca", other)
    pki.write("foreign", new_client(other, "plc", "operator", pki.now, 365))
    pki.write("self_signed", other)
    return pki


@pytest.fixture
def source():
    return MemorySource()


@pytest.fixture
def server(tmp_path, pki, source):
    with serving(tmp_path, source, pki.files()) as server:
        yield server


def request(server, context, words):
    """Send one request on a new connection. Return the answer."""
    with server.connect(context) as client:
        return send_request(client, words)


def code(answer):
    """Return the exception code in an answer, 0 for success."""
    data = bytes.fromhex(answer)
    return data[8] if data[7] & 0x80 else 0


@pytest.mark.parametrize(
    ("name", "vent", "hold", "setpoint", "both", "unknown"),
    [
        ("plc", 0, 0, 0, 0, 2),
        ("setter", 0, 1, 0, 1, 2),
        ("hmi", 0, 1, 1, 1, 1),
        ("unknown", 0, 1, 1, 1, 1),
        ("nobody", 0, 1, 1, 1, 1),
    ],
)
def test_a_role_decides_what_is_written(server, pki, source, name, vent, hold, setpoint, both, unknown):
    with server.connect(pki.context(name)) as client:
        assert send_request(client, FORCE) == "00 01 00 00 00 07 01 04 04 3f a0 00 00"
        expected = {
            VENT: vent,
            HOLD: hold,
            SETPOINT: setpoint,
            SETPOINT_AND_LIMIT: both,
            UNKNOWN_ADDRESS: unknown,
        }
        assert {request: code(send_request(client, request)) for request in expected} == expected
    assert {"mode": "vent"} in source.write_requests
    assert ({"mode": "hold"} in source.write_requests) == (hold == 0)


def test_a_write_belongs_to_the_certificate_and_not_to_the_address(server, pki, source):
    for name in ("plc", "plc", "hmi"):
        with server.connect(pki.context(name)) as client:
            send_request(client, UNKNOWN_ADDRESS)
    peers = [peer for peer, *_ in source.rejected_writes]
    assert [re.fullmatch(r"(\w+) [0-9a-f]{20}", peer.address)[1] for peer in peers] == ["plc", "plc", "hmi"]
    assert {peer.channel for peer in peers} == {"modbus_tls"}
    assert peers[0] == peers[1]


@pytest.mark.parametrize("version", [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3])
def test_both_versions_of_tls(server, pki, version):
    context = pki.context("plc")
    context.minimum_version = context.maximum_version = version
    with server.connect(context) as client:
        assert code(send_request(client, FORCE)) == 0


@pytest.mark.parametrize(
    ("name", "reason", "alert"),
    [
        ("", "peer did not return a certificate", "certificate required|handshake failure"),
        ("expired", "certificate has expired", "certificate expired"),
        ("future", "certificate is not yet valid", "bad certificate|certificate unknown|expired"),
        ("foreign", "unable to get local issuer certificate", "unknown ca"),
        ("self_signed", "self-signed certificate", "unknown ca"),
        ("instrument", "unsuitable certificate purpose|unsupported certificate purpose", "unsupported"),
    ],
)
def test_a_bad_certificate_is_counted_and_the_client_learns_why(server, pki, source, name, reason, alert):
    with pytest.raises(ssl.SSLError, match=alert.replace(" ", "[ _]")) as caught:
        request(server, pki.context(name), VENT)
    assert caught.value.reason
    assert eventually(lambda: server.gateway.counters.failed)
    assert [each for each in server.gateway.counters.failed if re.fullmatch(reason, each)]
    assert heartbeat(1, server.gateway)["failed"] == 1  # a number, as all metrics
    assert source.write_requests == []


@pytest.mark.parametrize(
    ("name", "alert"), [("expired", "certificate expired"), ("foreign", "unknown ca"), ("plc", "")]
)
def test_a_client_reports_in_words_that_its_certificate_is_rejected(server, pki, name, alert):
    files = ClientFiles(*(pki.folder / file for file in ("ca.pem", f"{name}.pem", f"{name}.key")))
    context = client_context("localhost", files)
    if not alert:
        assert handshake_problem("127.0.0.1", server.port, context, 0.2) == ""
        return
    with pytest.raises(NoAnswerError) as caught:
        ModbusClient.connect_tls("127.0.0.1", server.port, context, wait_s=5.0)
    assert re.search(
        rf"does not accept the certificate of this client \(\w+ alert {alert}\)", str(caught.value)
    )
    assert "pneuforce certificates show" in str(caught.value)


@pytest.mark.parametrize("options", [["-tls1_1"], ["-tls1_2", "-cipher", "AES128-SHA256:AES256-GCM-SHA384"]])
def test_old_protocols_and_weak_ciphers_are_rejected_with_an_alert(server, pki, options):
    files = ["-cert", pki.folder / "plc.pem", "-key", pki.folder / "plc.key"]
    command = ["openssl", "s_client", "-connect", f"127.0.0.1:{server.port}", *options, *files]
    done = subprocess.run(command, input=b"", capture_output=True, timeout=60, check=False)
    assert done.returncode != 0
    assert b"alert" in done.stderr
    assert b"Cipher is (NONE)" in done.stdout


def test_a_resumed_session_has_the_role_of_its_certificate_until_it_expires(server, pki, source, monkeypatch):
    context = pki.context("plc")
    context.maximum_version = ssl.TLSVersion.TLSv1_2
    with server.connect(context) as first:
        send_request(first, FORCE)
        session = first.session
    with server.connect(context, session) as second:
        assert code(send_request(second, HOLD)) == 0
        assert second.session_reused
    monkeypatch.setattr(gateway_module.time, "time", lambda: (pki.now + timedelta(days=366)).timestamp())
    with server.connect(context, session) as third, suppress(OSError):
        assert send_request(third, VENT) == ""
    assert source.write_requests == [{"mode": "hold"}]


def test_pymodbus_reads_and_writes(server, pki, source):
    context = pki.context("plc")
    context.check_hostname = False  # the synchronous client of pymodbus does not pass the host name
    with ModbusTlsClient("127.0.0.1", port=server.port, sslctx=context) as client:
        assert client.read_input_registers(0, count=2).registers == [0x3FA0, 0]
        assert not client.write_register(544, 8000).isError()
    assert source.values["setpoint_requested_kpa"] == 8.0


def test_bytes_that_are_not_tls_are_no_request(server, source):
    with socket.create_connection(("127.0.0.1", server.port), timeout=15) as client:
        client.sendall(bytes.fromhex(VENT))
        assert len(read_until_closed(client)) <= 7  # at most an alert
    assert source.write_requests == []


def test_silent_clients_do_not_keep_others_out(server, pki):
    silent = [socket.create_connection(("127.0.0.1", server.port), timeout=15) for _ in range(100)]
    with server.connect(pki.context("plc")) as client:
        assert code(send_request(client, FORCE)) == 0
    assert eventually(lambda: server.gateway.counters.failed["too many handshakes"] >= 36)
    for each in silent:
        each.close()


def test_an_address_that_is_not_allowed_is_closed_before_the_handshake(tmp_path, pki, source):
    with serving(tmp_path, source, pki.files(), allow=["192.0.2.1"]) as server:
        plain = socket.create_connection(
            ("127.0.0.1", server.port), timeout=15, source_address=("127.0.0.2", 0)
        )
        with plain:
            assert plain.recv(1) == b""
        assert server.gateway.counters.not_allowed == 1


def test_a_new_certificate_is_used_without_a_restart_and_open_connections_stay(tmp_path, source, monkeypatch):
    monkeypatch.setattr(gateway_module, "RELOAD_PERIOD_S", 0.1)
    monkeypatch.setattr(gateway_module, "CHECK_PERIOD_S", 0.05)
    pki = Pki(tmp_path / "pki")
    pki.client("plc", "operator")
    with serving(tmp_path, source, pki.files()) as server:

        def certificate():
            with server.connect(pki.context("plc")) as client:
                return client.getpeercert()["serialNumber"]

        with server.connect(pki.context("plc")) as open_connection:
            before = certificate()
            (pki.folder / "instrument.key").write_bytes(b"half a file")
            time.sleep(0.3)
            assert certificate() == before
            pki.renew_instrument()
            assert eventually(lambda: certificate() != before)
            assert code(send_request(open_connection, FORCE)) == 0


def test_a_revoked_certificate_is_disconnected_and_rejected(tmp_path, source, monkeypatch):
    monkeypatch.setattr(gateway_module, "RELOAD_PERIOD_S", 0.1)
    monkeypatch.setattr(gateway_module, "CHECK_PERIOD_S", 0.05)
    pki = Pki(tmp_path / "pki")
    plc, hmi = pki.client("plc", "operator"), pki.client("hmi", "viewer")
    crl = pki.folder / "crl.pem"
    crl.write_bytes(revocation_list(pki.authority, {}, pki.now))
    with serving(tmp_path, source, pki.files(str(crl))) as server:
        with server.connect(pki.context("plc")) as client:
            assert code(send_request(client, FORCE)) == 0
            crl.write_bytes(revocation_list(pki.authority, {plc.certificate.serial_number: pki.now}, pki.now))
            assert read_answer(client) == ""
        with pytest.raises(ssl.SSLError, match="revoked"):
            request(server, pki.context("plc"), VENT)
        with server.connect(pki.context("hmi")) as client:
            assert code(send_request(client, FORCE)) == 0
    assert hmi.certificate.serial_number != plc.certificate.serial_number


def test_an_overdue_list_of_revoked_certificates_rejects_all_clients(tmp_path, source):
    pki = Pki(tmp_path / "pki")
    pki.client("plc", "operator")
    with serving(tmp_path, source, pki.files(str(pki.write_overdue_list(1)))) as server:
        with pytest.raises(ssl.SSLError):
            request(server, pki.context("plc"), VENT)
        assert eventually(lambda: server.gateway.counters.failed["CRL has expired"] == 1)


def test_a_connection_ends_with_its_certificate(tmp_path, source, monkeypatch):
    monkeypatch.setattr(gateway_module, "CHECK_PERIOD_S", 0.05)
    pki = Pki(tmp_path / "pki")
    plc = pki.client("plc", "operator", days=1)
    with serving(tmp_path, source, pki.files()) as server, server.connect(pki.context("plc")) as client:
        assert code(send_request(client, FORCE)) == 0
        after = plc.certificate.not_valid_after_utc + timedelta(seconds=1)
        monkeypatch.setattr(gateway_module.time, "time", lambda: after.timestamp())
        with suppress(OSError):
            assert client.recv(1) == b""


def test_a_client_that_reads_nothing_is_closed(server, pki, monkeypatch):
    monkeypatch.setattr(gateway_module, "READ_TIMEOUT_S", 0.5)
    request = bytes.fromhex("0001 0000 0006 01 03 0200 001e".replace(" ", ""))
    with server.connect(pki.context("plc")) as client:
        client.settimeout(0.5)
        with suppress(OSError):  # a full buffer at first, then a closed connection
            while True:
                client.sendall(request * 100)
        assert eventually(lambda: not server.gateway._clients)
