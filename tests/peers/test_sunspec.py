"""Tests of Modbus/TCP Security with the client of pysunspec2 and the certificates that it ships."""

from contextlib import suppress
from importlib.resources import files

import pytest
from sunspec2.modbus.modbus import ModbusClientError, ModbusClientTCP

from pneuforce.registers.modbus_security.certificate import identity_of
from pneuforce.support.tls_files import TlsFiles
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import eventually
from tests.registers.modbus_security.serving import serving

DATA = files("sunspec2") / "tests/tls_data"
FORCE = bytes.fromhex("3fa00000")


@pytest.fixture
def source():
    return MemorySource()


@pytest.fixture
def server(tmp_path, source):
    own = DATA / "server/tls1_3/server_valid"
    tls = TlsFiles(ca=str(DATA / "ca/client_ca_chain.crt"), certificate=f"{own}.crt", key=f"{own}.key")
    with serving(tmp_path, source, tls, roles={"SuperAdministratorSunSpec": ("setpoint", "mode")}) as server:
        yield server


def client(server, name):
    return ModbusClientTCP(
        1,
        "localhost",
        server.port,
        timeout=10,
        tls=True,
        cafile=str(DATA / "ca/server_ca_chain.crt"),
        certfile=str(DATA / f"client/{name}.crt"),
        keyfile=str(DATA / f"client/{name}.key"),
    )


@pytest.mark.parametrize("version", ["tls1_2", "tls1_3"])
@pytest.mark.parametrize(
    ("name", "may_write"),
    [
        ("superadmin", True),
        ("readonly", False),
        ("gridservice", False),
        ("netadmin", False),
    ],
)
def test_each_role_reads_and_vents_and_only_a_known_role_writes(server, source, version, name, may_write):
    plc = client(server, f"{version}/client_{name}")
    plc.connect()
    assert plc.read(0, 2) == FORCE
    plc.write(516, b"\0\0")
    if may_write:
        plc.write(512, bytes.fromhex("40c00000"))
    else:
        with pytest.raises(Exception, match="exception: 1"):
            plc.write(512, bytes.fromhex("40c00000"))
    plc.disconnect()
    assert source.write_requests[0] == {"mode": "vent"}
    assert (source.values["setpoint_requested_kpa"] == 6.0) == may_write


@pytest.mark.parametrize("name", ["no_role", "malformed_role"])
def test_a_certificate_without_a_valid_role_belongs_to_a_viewer(server, source, name):
    plc = client(server, f"invalid/client_{name}")
    plc.connect()
    assert plc.read(0, 2) == FORCE
    plc.write(516, b"\0\0")
    with pytest.raises(Exception, match="exception: 1"):
        plc.write(516, b"\0\1")
    plc.disconnect()
    assert source.values["mode"] == "vent"


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("expired", "certificate has expired"),
        ("self_signed", "self-signed certificate"),
        ("foreign_ca", "unable to get local issuer certificate"),
    ],
)
def test_invalid_certificates_are_rejected(server, source, name, reason):
    plc = client(server, f"invalid/client_{name}")
    with suppress(ModbusClientError, OSError):  # TLS 1.3: the client learns it when it reads
        plc.connect()
        plc.write(516, b"\0\0")
    assert eventually(lambda: server.gateway.counters.failed[reason])
    assert source.write_requests == []


def test_the_certificates_of_the_package_have_the_roles_that_they_name():
    from cryptography import x509
    from cryptography.hazmat.primitives.serialization import Encoding

    def role(name):
        certificate = x509.load_pem_x509_certificate((DATA / f"client/{name}.crt").read_bytes())
        return identity_of(certificate.public_bytes(Encoding.DER)).role

    assert role("tls1_3/client_readonly") == "ReadOnlySunSpec"
    assert role("invalid/client_malformed_role") == ""
