"""Tests of ModbusClient and of the client of pymodbus with a TCP server."""

import math
import socket

import pytest
from pymodbus.client import ModbusTcpClient

from pneuforce.registers.map import REGISTERS
from pneuforce.registers.modbus import client as client_module
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import serving


@pytest.fixture
def source():
    return MemorySource()


@pytest.fixture
def server(source):
    with serving(source) as server:
        yield server


@pytest.fixture
def plc(server):
    with ModbusClient.connect(port=server.port) as plc:
        yield plc


def test_the_client_reads_every_value_by_name(plc):
    values = plc.read()
    assert values["force"] == 1.25
    assert values["pressure"] == 8.5
    assert values["state"] == "vented"
    assert values["status"] == {"vented", "simulated", "any_failure"}
    assert values["mode"] == "vent"
    assert math.isnan(values["rise"])
    assert values["setpoint_requested"] == 5.0
    assert values["condensed_status"] == {"simulated"}


def test_no_name_ends_in_a_unit_that_differs_from_the_unit_of_its_value(plc):
    for values in (plc.read(), plc.read_all()):
        assert {name.rpartition("_")[2] for name in values} & {"mn", "pa", "um", "ms"} == set()
        assert {"force", "pressure", "radius", "setpoint", "rise", "peak_force", "force_limit"} <= set(values)


def test_the_client_sets_the_pressure_holds_and_vents(plc, source):
    plc.write("setpoint_requested", 8.0)
    plc.write("mode", "hold")
    assert (source.values["setpoint_requested_kpa"], source.values["mode"]) == (8.0, "hold")
    plc.vent()
    assert source.values["mode"] == "vent"


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("setpoint_requested", 12.5, "illegal value (03h); allowed: 2 … 12 kPa"),
        ("setpoint_requested", math.nan, "illegal value (03h); allowed: 2 … 12 kPa"),
        ("setpoint_requested_pa", 6.5, "write setpoint_requested instead"),
        ("lease", 70.0, "allowed: 0 or 0.2 … 60 s"),
        ("force", 1.0, "force is read-only"),
        ("setpoint", 6.0, "read-only: write setpoint_requested instead"),
        ("mode", "hodl", "mode = hodl: invalid value; allowed: vent, hold"),
        ("mode", [], "mode = []: invalid value; allowed: vent, hold"),
        ("setpoint_requested", 1e40, "invalid value; allowed: 2 … 12 kPa"),
        ("setpoint_requested", "eight", "invalid value; allowed: 2 … 12 kPa"),
        ("setpoint_pa", 6.0, "setpoint_pa repeats another register: write setpoint_requested instead"),
        ("setpiont", 6.0, "setpiont: unknown register; similar: setpoint_requested"),
        ("forcelimit", 1, "forcelimit: unknown register; similar: force_limit"),
        ("colour", 1, "colour: unknown register"),
    ],
)
def test_a_rejected_write_raises_an_error_with_the_allowed_values(plc, name, value, message):
    with pytest.raises(ModbusClientError) as error:
        plc.write(name, value)
    assert message in str(error.value)


def test_the_error_contains_the_reject_reason_of_the_instrument(plc, source):
    source.reject = lambda peer, values: "not_zeroed"
    with pytest.raises(
        ModbusClientError, match=r"mode = hold was rejected: device busy \(06h\), reason not_zeroed"
    ):
        plc.write("mode", "hold")


def test_the_client_determines_the_word_order(source):
    with serving(source, word_swap=True) as server, ModbusClient.connect(port=server.port) as plc:
        assert plc.read()["force"] == 1.25
        plc.write("setpoint_requested", 8.0)
    assert source.values["setpoint_requested_kpa"] == 8.0


def test_a_closed_port_raises_an_error():
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        with pytest.raises(ModbusClientError, match="no Modbus TCP server answers"):
            ModbusClient.connect(port=unused.getsockname()[1], wait_s=0.5)


def test_a_server_that_does_not_answer_raises_an_error():
    with (
        socket.create_server(("127.0.0.1", 0)) as silent,
        pytest.raises(ModbusClientError, match="does not answer"),
    ):
        ModbusClient.connect(port=silent.getsockname()[1], wait_s=0.2)


def test_a_lost_connection_raises_an_error(source):
    with serving(source) as server:
        plc = ModbusClient.connect(port=server.port, wait_s=0.5)
    with pytest.raises(ModbusClientError):
        plc.read()


def test_pymodbus_reads_writes_and_identifies(server, source):
    with ModbusTcpClient("127.0.0.1", port=server.port) as client:
        floats = client.DATATYPE.FLOAT32
        force = client.read_holding_registers(0, count=2).registers
        assert client.convert_from_registers(force, floats) == 1.25
        assert client.read_discrete_inputs(0, count=32).bits[3] is True
        assert client.write_registers(512, client.convert_to_registers(8.0, floats)).isError() is False
        assert source.values["setpoint_requested_kpa"] == 8.0
        assert client.write_register(544, 7000).isError() is False
        assert client.mask_write_register(address=516, and_mask=0xFFFE, or_mask=1).isError() is False
        assert source.values["mode"] == "hold"
        both = client.readwrite_registers(read_address=512, read_count=2, write_address=516, values=[0])
        assert client.convert_from_registers(both.registers, floats) == 7.0
        assert source.values["mode"] == "vent"
        assert client.write_registers(512, [0, 0]).exception_code == 3
        assert client.read_coils(0).exception_code == 2
        assert client.read_holding_registers(0, device_id=9).exception_code == 11
        identity = client.read_device_information(read_code=3)
        assert identity.information[0] == b"pneuforce"
        assert identity.information[0x80] == b"42"


def test_the_client_reads_each_register_of_the_map():
    ranges = (*client_module._CHANGING_RANGES, *client_module._CONSTANT_RANGES)
    missed = [
        register.name for register in REGISTERS if not any(register.address in range_ for range_ in ranges)
    ]
    assert missed == []


def test_a_request_after_the_close_opens_no_other_connection(server):
    client = ModbusClient.connect(port=server.port)
    client.close()
    with pytest.raises(ModbusClientError, match="the connection is closed"):
        client.read()
    assert client._client.socket is None
