"""Tests of commands: a vent and a rebirth are executed, everything else is rejected with a sentence."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.mqtt.commands import SparkplugCommand, parse_commands
from pneuforce.mqtt.payload import MAX_COMMAND_BYTES
from pneuforce.mqtt.schema import PayloadMessage

VENT, REBIRTH = SparkplugCommand.VENT, SparkplugCommand.REBIRTH
TRUE = {"datatype": 11, "boolean_value": True}


def command(*metrics):
    payload = PayloadMessage(timestamp=1)
    for name, fields in metrics:
        payload.metrics.add(name=name, **fields)
    return payload.SerializeToString()


def test_a_vent_and_a_rebirth_are_executed():
    assert list(parse_commands(command(("Vent", TRUE))).commands) == [VENT]
    assert list(parse_commands(command(("Node Control/Rebirth", TRUE))).commands) == [REBIRTH]


def test_a_vent_beside_another_write_is_executed():
    parsed = parse_commands(command(("setpoint", {"datatype": 9, "float_value": 5.0}), ("Vent", TRUE)))
    assert list(parsed.commands) == [VENT]
    assert "setpoint" in parsed.rejected[0]


REJECTED = [
    ("Vent", {"datatype": 11, "boolean_value": False}),
    ("Vent", {"datatype": 11, "is_null": True}),
    ("Vent", {"datatype": 11, "is_null": True, "boolean_value": True}),
    ("Vent", {"datatype": 9, "float_value": 1.0}),
    ("Vent", {"datatype": 9, "float_value": math.nan}),
    ("Vent", {"datatype": 9, "boolean_value": True}),
    ("Vent", {"datatype": 99, "boolean_value": True}),
    ("Vent", {"datatype": 4, "long_value": 1}),
    ("Vent", {"datatype": 12, "string_value": "true"}),
    ("Vent", {}),
    ("vent", TRUE),
    ("", TRUE),
    ("mode", {"datatype": 12, "string_value": "hold"}),
    ("setpoint_requested", {"datatype": 9, "float_value": 5.0}),
    ("Node Control/Reboot", TRUE),
    ("a\x1b[2Jb\n" * 50, TRUE),
]


@pytest.mark.parametrize(("name", "fields"), REJECTED, ids=range(len(REJECTED)))
def test_other_writes_are_rejected_with_one_line(name, fields):
    commands, rejected = parse_commands(command((name, fields)))
    assert (list(commands), len(rejected)) == ([], 1)
    assert rejected[0].isprintable()
    assert len(rejected[0]) < 400


def test_a_retained_vent_is_rejected():
    assert parse_commands(command(("Vent", TRUE)), retained=True).commands == ()


BROKEN = [
    b"",
    b"\xff" * 20,
    command(("Vent", TRUE))[:-1],
    b"\x12\x03\x0a\x01\xff",
    bytes(MAX_COMMAND_BYTES + 1),
]


@pytest.mark.parametrize("data", BROKEN, ids=range(len(BROKEN)))
def test_broken_bytes_are_rejected_with_one_line(data):
    commands, rejected = parse_commands(data)
    assert (list(commands), len(rejected)) == ([], 1)


@given(st.binary(max_size=200))
def test_random_bytes_cause_no_exception_and_no_vent(data):
    assert VENT not in parse_commands(data).commands
