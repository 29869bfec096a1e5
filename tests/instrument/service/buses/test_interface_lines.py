"""Tests of the lines that state where each interface is served, and of the errors if one cannot be served."""

import asyncio
import socket

import pytest

from pneuforce.errors import ServerError
from pneuforce.instrument.config import parse
from pneuforce.instrument.service.buses.interface_lines import (
    can_line,
    disabled_line,
    modbus_rtu_line,
    modbus_tcp_line,
)
from pneuforce.instrument.service.buses.modbus_server import modbus_server_of, open_modbus
from pneuforce.instrument.service.buses.rdt_server import open_rdt, rdt_server_of
from pneuforce.instrument.service.buses.rtu_server import RtuServer
from tests.registers.can.fake_source import FakeSource

FOREIGN = "192.0.2.1"  # RFC 5737: no computer has this address


def test_the_lines_of_modbus_contain_address_unit_and_access():
    tables = {"host": "127.0.0.5", "unit": 9, "read_only": True}
    configuration = parse({"modbus": tables, "modbus_rtu": {"unit": 7}}, "test")
    line = modbus_tcp_line(configuration, 1502)
    assert all(fact in line for fact in ("Modbus TCP", "127.0.0.5:1502", "9", "read-only"))
    line = modbus_rtu_line(configuration, "/dev/ttyS0, 19200 8E1")
    assert all(fact in line for fact in ("Modbus RTU", "/dev/ttyS0, 19200 8E1", "7"))
    assert "read-only" not in line


@pytest.mark.parametrize(
    ("mode", "present", "absent"),
    [
        ("raw", ("CAN on", "207h Command", "187h Force", "507h Identity"), ("607h", "587h")),
        ("canopen", ("CANopen on", "207h Command", "607h SDO", "587h SDO", "187h Force"), ("507h",)),
    ],
)
def test_the_line_of_can_contains_interface_node_bit_rate_and_identifiers(mode, present, absent):
    tables = {"can": {"enabled": True, "mode": mode, "node_id": 7, "bit_rate": 250_000}}
    line = can_line(parse(tables, "test").can, "socketcan can0")
    assert all(fact in line for fact in (*present, "socketcan can0", "node 7", "250000"))
    assert not any(identifier in line for identifier in absent)


def test_the_disabled_interfaces_are_named_with_their_section():
    tables = {"modbus": {"enabled": False}, "rdt": {"enabled": True}}
    line = disabled_line(parse(tables, "test"))
    assert all(section in line for section in ("[modbus]", "[modbus_rtu]", "[can]", "[web]"))
    assert "[rdt]" not in line


async def open_modbus_tcp(configuration):
    await open_modbus(modbus_server_of(configuration, FakeSource()), configuration)


async def open_modbus_rtu(configuration):
    await RtuServer(configuration, FakeSource(), {}).open()


async def open_rdt_server(configuration):
    await open_rdt(rdt_server_of(FakeSource(), configuration.rdt))


@pytest.mark.parametrize(
    ("open_server", "section", "table"),
    [
        (open_modbus_tcp, "modbus", {"host": FOREIGN, "allow": ["127.0.0.1"]}),
        (open_modbus_rtu, "modbus_rtu", {"enabled": True, "port": "/dev/missing"}),
        (open_rdt_server, "rdt", {"enabled": True, "host": FOREIGN, "allow": ["127.0.0.1"]}),
    ],
)
def test_an_interface_that_cannot_be_served_is_named_with_the_key_to_correct(open_server, section, table):
    with pytest.raises(ServerError, match=rf"\[{section}\]") as caught:
        asyncio.run(open_server(parse({section: table}, "test")))
    assert table.get("host", table.get("port")) in str(caught.value)


def test_a_port_in_use_is_named_with_the_key_to_correct():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ServerError, match=r"\[modbus\] port") as caught:
            asyncio.run(open_modbus_tcp(parse({"modbus": {"port": port}}, "test")))
    assert f"127.0.0.1:{port}" in str(caught.value)
