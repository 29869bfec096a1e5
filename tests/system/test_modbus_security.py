"""System tests of Modbus/TCP Security: the complete instrument with certificates made by the command."""

import json
import socket
import ssl
import subprocess
from contextlib import ExitStack

import pytest

import pneuforce as pneuforce_package
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import free_port, start
from tests.command_runner import pneuforce
from tests.registers.modbus.serving import eventually, send_request
from tests.system.waiting import wait_for
from tests.tools import needs

LEASE, NO_LEASE = "0001 0000 0006 01 06 0205 ea60", "0001 0000 0006 01 06 0205 0000"
SETPOINT = "0001 0000 0006 01 06 0220 1770"
ACCEPTED, BUSY, FORBIDDEN = "06", "86 06", "86 01"


def made(*words):
    done = pneuforce("certificates", *words)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pki")
    made("authority", folder)
    made("instrument", folder, "--host", "localhost", "--days", "20")
    made("client", folder, "plc", "--role", "operator")
    made("client", folder, "robot", "--role", "operator")
    made("client", folder, "hmi")
    return folder


@pytest.fixture(scope="module")
def instrument(folder):
    port = free_port()
    tls = {"ca": "ca.pem", "certificate": "instrument.pem", "key": "instrument.key"}
    section = {"enabled": True, "port": port} | {name: str(folder / file) for name, file in tls.items()}
    with ExitStack() as children:
        stack = start(children, folder / "rig", ["--no-hand"], {"modbus_security": section})
        with ModbusClient.connect(port=stack.modbus_port) as plc:
            wait_for(plc.read, lambda v: "vented" in v["status"])
            yield stack, port, plc


@pytest.fixture
def connect(instrument, folder):
    """Return a function that connects with the certificate of a client."""
    _, port, _ = instrument
    with ExitStack() as connections:

        def connect(name):
            context = ssl.create_default_context(cafile=folder / "ca.pem")
            context.load_cert_chain(folder / f"{name}.pem", folder / f"{name}.key")
            assert eventually(lambda: is_open(port))
            plain = socket.create_connection(("127.0.0.1", port), timeout=15)
            return connections.enter_context(context.wrap_socket(plain, server_hostname="localhost"))

        yield connect


def is_open(port):
    try:
        socket.create_connection(("127.0.0.1", port), timeout=1).close()
    except OSError:
        return False
    return True


def write(client, words):
    """Send a write request. Return function code and exception code of the answer."""
    answer = send_request(client, words)[21:]
    return answer[:5] if answer.startswith("86") else answer[:2]


def test_the_json_line_of_the_instrument_contains_the_port_of_the_gateway(instrument):
    stack, port, _ = instrument
    assert stack.ports == {"modbus": stack.modbus_port, "modbus_security": port}


def test_a_lease_belongs_to_a_certificate(instrument, connect):
    _, _, registers = instrument
    assert write(connect("plc"), LEASE) == ACCEPTED
    assert registers.read()["lease_holder"] == "modbus_tls"
    assert write(connect("robot"), SETPOINT) == BUSY
    assert write(connect("hmi"), SETPOINT) == FORBIDDEN
    again = connect("plc")
    assert write(again, SETPOINT) == ACCEPTED
    assert write(again, NO_LEASE) == ACCEPTED
    assert registers.read()["setpoint_requested"] == 6.0


def test_the_event_log_names_the_certificate_and_failed_handshakes(instrument, connect, folder):
    _, port, _ = instrument
    connect("hmi")
    socket.create_connection(("127.0.0.1", port), timeout=15).close()
    write(connect("plc"), SETPOINT.replace("1770", "1388"))

    def entries():
        shown = pneuforce("log", "show", "--file", folder / "events.sqlite", "--json", "--last", "0")
        return [json.loads(line) for line in shown.stdout.splitlines()]

    def found(**facts):
        return [each for each in entries() if facts.items() <= each.items()]

    name = json.loads(made("show", folder / "plc.pem", "--json"))["name"]
    assert eventually(lambda: found(who=f"modbus_tls {name}"))
    assert eventually(lambda: found(kind="login", who="modbus_tls 127.0.0.1"))


def test_a_certificate_that_expires_soon_requires_maintenance(instrument):
    _, _, registers = instrument
    wait_for(registers.read, lambda values: "maintenance_required" in values["status"])


def test_programs_and_commands_use_certificates(instrument, connect, folder):
    _, port, _ = instrument
    connect("plc")
    url = f"tls://localhost:{port}?ca={folder}/ca.pem&certificate={folder}/{{0}}.pem&key={folder}/{{0}}.key"
    with pneuforce_package.connect(url.format("plc")) as sensor:
        assert sensor.read().pressure_kpa < 1.0
    viewer = pneuforce_package.connect(url.format("hmi"))
    with viewer, pytest.raises(pneuforce_package.Rejected, match="role"), viewer.hold(5.0):
        pass
    with pytest.raises(
        pneuforce_package.ConnectionFailed, match="certificate is not accepted: IP address mismatch"
    ):
        pneuforce_package.connect(url.format("plc").replace("localhost", "127.0.0.1"))
    options = ["--host", "localhost", "--port", port, "--ca", folder / "ca.pem"]
    options += ["--certificate", folder / "hmi.pem", "--key", folder / "hmi.key"]
    assert pneuforce("vent", *options).returncode == 0
    watched = pneuforce("watch", "modbus", "--seconds", "0.1", "--json", *options)
    assert json.loads(watched.stdout.splitlines()[-1])["state"] == "vented"
    rejected = pneuforce("set", "6", *options)
    assert rejected.returncode == 3
    assert "role" in rejected.stderr


@needs("mbpoll", "socat")
def test_mbpoll_reads_through_socat(instrument, connect, folder):
    """A master without TLS can use any TLS tunnel; stunnel works in the same way."""
    _, port, _ = instrument
    connect("plc")
    tunnel = free_port()
    tls = f"cert={folder}/plc.pem,key={folder}/plc.key,cafile={folder}/ca.pem,commonname=localhost"
    command = [
        "socat",
        f"TCP-LISTEN:{tunnel},bind=127.0.0.1,reuseaddr,fork",
        f"OPENSSL:127.0.0.1:{port},{tls}",
    ]
    with subprocess.Popen(command) as socat:
        try:
            assert eventually(lambda: is_open(tunnel))
            poll = ["mbpoll", "-m", "tcp", "-p", str(tunnel), "-0", "-1", "-r", "544", "127.0.0.1", "7000"]
            done = subprocess.run(poll, capture_output=True, text=True, timeout=60, check=False)
            assert "Written 1 references." in done.stdout, done.stderr + done.stdout
        finally:
            socat.terminate()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"certificate": "missing.pem"}, "missing.pem: no such file"),
        ({"key": "plc.key"}, "plc.key is not the key of the certificate"),
        ({"ca": "instrument.key"}, "instrument.key contains no valid certificate"),
        ({"roles": {"operator": ["everything"]}}, "everything of the role operator is not a right"),
        ({"host": "0.0.0.0"}, "add the clients that may connect"),
    ],
)
def test_a_wrong_configuration_is_explained(folder, change, sentence):
    settings = {"enabled": True} | change
    roles = settings.pop("roles", None)
    lines = ["[modbus_security]", *(f"{name} = {json.dumps(value)}" for name, value in settings.items())]
    if roles:
        lines.append("roles = { operator = ['everything'] }")
    file = folder / "instrument.toml"
    file.write_text("\n".join(lines))
    checked = pneuforce("config", "--check", file)
    assert checked.returncode == 78
    assert sentence in checked.stderr
    assert checked.stderr.count("\n") == 1
