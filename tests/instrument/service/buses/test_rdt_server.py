"""Tests of the RDT server of the host: when it exists, its health, and ports that cannot be used."""

import asyncio
import socket

import pytest

from pneuforce.errors import ServerError
from pneuforce.instrument.config import parse
from pneuforce.instrument.service.buses.rdt_server import open_rdt, rdt_server_of
from pneuforce.instrument.service.health import rdt_health
from pneuforce.registers.rdt.record import RdtCommand, encode_request
from tests.registers.can.fake_source import FakeSource
from tests.registers.rdt.serving import loopback_address


def server_of(**settings):
    return rdt_server_of(FakeSource(), parse({"rdt": settings}, "my.toml").rdt)


def test_without_the_configuration_nothing_is_served():
    assert server_of() is None
    assert rdt_health(None) is None


def test_the_health_counts_clients_records_and_refused_requests():
    server = server_of(enabled=True, host=loopback_address())
    assert rdt_health(server) is None
    asyncio.run(open_rdt(server))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.connect((server.options.host, server.port))
        client.send(encode_request(RdtCommand.START_REALTIME))
        client.send(encode_request(RdtCommand.SET_BIAS))
        server.on_sample(1.0)
        facts = rdt_health(server)
    server.close()
    assert facts == {"port": 49152, "clients": 1, "records": 1, "dropped": 0, "requests": 2, "refused": 1}
    assert rdt_health(server) is None


def test_a_port_in_use_is_reported():
    server = server_of(enabled=True, host=loopback_address())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind((server.options.host, server.options.port))
        with pytest.raises(ServerError, match="49152"):
            asyncio.run(open_rdt(server))


def test_an_address_of_another_machine_is_reported():
    server = server_of(enabled=True, host="192.0.2.1", allow=["192.0.2.0/24"])
    with pytest.raises(ServerError, match=r"192\.0\.2\.1"):
        asyncio.run(open_rdt(server))
