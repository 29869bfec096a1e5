"""Tests of write requests with register names: the same writes are valid as for a Modbus client."""

import math

import pytest

from pneuforce.registers.map import REGISTERS
from pneuforce.registers.write_request import MalformedWriteRequest, parse_write_request


@pytest.mark.parametrize("register", [r for r in REGISTERS if r.writable], ids=lambda r: r.name)
def test_the_limits_of_each_range_are_accepted_and_values_beyond_are_rejected(register):
    if register.low is None:
        return
    for value in (register.low, register.high):
        number = value if register.wire.name == "F32" else int(value)
        assert parse_write_request({register.name: number})[register.quantity] == register.decode(number)
    for value in (register.low - 1, register.high + 1):
        with pytest.raises(MalformedWriteRequest, match=register.name):
            parse_write_request({register.name: value})


@pytest.mark.parametrize("register", [r for r in REGISTERS if not r.writable], ids=lambda r: r.name)
def test_read_only_registers_are_rejected(register):
    with pytest.raises(MalformedWriteRequest, match=rf"^{register.name}: .*read-only"):
        parse_write_request({register.name: 1})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("setpoint_requested", math.nan),
        ("setpoint_requested", math.inf),
        ("setpoint_requested", "8"),
        ("setpoint_requested", None),
        ("setpoint_requested", True),
        ("setpoint_requested", [8.0]),
        ("setpoint_requested", 10**400),
        ("mode", "inflate"),
        ("mode", 2),
        ("mode", 0.5),
        ("mode", -1),
        ("lease", 65536),
        ("command_argument", 65536),
        ("command_argument", -1),
        ("command_key", 20551),
        ("", 1),
        ("no_such", 1),
    ],
)
def test_invalid_values_are_rejected_with_a_short_message(name, value):
    with pytest.raises(MalformedWriteRequest) as error:
        parse_write_request({name: value})
    assert len(str(error.value)) < 500


def test_codes_are_accepted_by_name_and_by_number():
    assert parse_write_request({"mode": "hold"}) == parse_write_request({"mode": 1}) == {"mode": "hold"}
    assert parse_write_request({"lease": 0, "setpoint_requested": 8}) == {
        "lease_s": 0.0,
        "setpoint_requested_kpa": 8.0,
    }


def test_an_empty_request_is_rejected():
    with pytest.raises(MalformedWriteRequest):
        parse_write_request({})
