"""Tests of the encoding and decoding of the CAN frames."""

import math

import pytest

from pneuforce.registers.can.frames import (
    ANSWER,
    COMMAND,
    EMERGENCY,
    FORCE,
    FRAMES,
    HEARTBEAT,
    IDENTITY,
    STATE,
    STATUS_FRAME,
    decode,
    decode_frame,
    encode,
)
from pneuforce.registers.can.wire import CanFrame, FrameKind
from tests.registers.can.fake_source import FakeSource

VALUES = FakeSource(
    force_n=1.234,
    force_std_n=0.0567,
    pressure_kpa=-0.002,
    setpoint_kpa=8.0,
    baseline_pressure_kpa=7.95,
    radius_mm=8.242,
    peak_force_n=-0.001,
    status=frozenset({"in_contact", "holding", "simulated", "force_valid", "any_failure"}),
    state="holding",
    reject_reason="lease",
    contact_counter=0x1FF,
    sample_counter=0x1_0000_0002,
    active_fault_count=2,
    serial_number=7,
    map_hash=0x01020304,
).now

BYTES = [
    (FORCE, {"counter": 7}, "d204 feff 3900 c3 07"),
    (STATE, {}, "401f 0e1f 3220 ffff"),
    (STATUS_FRAME, {}, "05800080 04 03 ff 02"),
    (ANSWER, {"sequence": 9, "result": "rejected_lease"}, "09 13 401f"),
    (EMERGENCY, {"error_code": 0xFF04, "error_register": 0x81}, "04ff 81 02 05800080"),
    (HEARTBEAT, {"node_state": "operational"}, "05"),
    (IDENTITY, {}, "04030201 07000000"),
    (COMMAND, {"setpoint": 8.0, "mode": "hold", "sequence": 3, "lease": 1.5, "proof_test": "allowed"},
     "401f 01 03 dc05 0000"),
]  # fmt: skip


@pytest.mark.parametrize(("frame", "node_values", "expected"), BYTES, ids=[row[0].name for row in BYTES])
def test_each_frame_is_encoded_to_these_bytes(frame, node_values, expected):
    assert encode(frame, VALUES, **node_values) == bytes.fromhex(expected)


def test_the_identifiers_are_those_of_a_canopen_node():
    assert {frame.name: frame.base_id for frame in FRAMES} == {
        "Force": 0x180,
        "State": 0x280,
        "Status": 0x380,
        "Answer": 0x480,
        "Command": 0x200,
        "Identity": 0x500,
        "Emergency": 0x080,
        "Heartbeat": 0x700,
    }


@pytest.mark.parametrize(
    ("value", "code"),
    [
        (math.nan, 0x7FFF),
        (1e9, 0x7FFE),
        (math.inf, 0x7FFE),
        (32.767, 0x7FFE),
        (-1e9, -0x8000),
        (-math.inf, -0x8000),
    ],
)
def test_a_force_out_of_range_saturates_next_to_the_not_available_code(value, code):
    data = encode(FORCE, FakeSource(force_n=value).now, counter=0)
    assert int.from_bytes(data[:2], "little", signed=True) == code


def test_a_value_that_is_not_available_decodes_to_nan():
    values = decode(FORCE, encode(FORCE, FakeSource().now, counter=0))
    assert all(math.isnan(values[name]) for name in ("force", "pressure", "force_uncertainty"))


def test_a_force_frame_decodes_to_the_encoded_values():
    values = decode(FORCE, encode(FORCE, VALUES, counter=200))
    assert values["force"] == pytest.approx(1.234)
    assert values["condensed_status"] == {"in_contact", "holding", "simulated", "force_valid"}
    assert values["counter"] == 200


@pytest.mark.parametrize(
    "frame",
    [
        CanFrame(0x186, bytes(8)),
        CanFrame(0x185, bytes(7)),
        CanFrame(0x185, bytes(8), FrameKind.EXTENDED),
        CanFrame(0x185, b"", FrameKind.REMOTE),
    ],
)
def test_a_frame_of_another_node_or_kind_is_not_decoded(frame):
    assert decode_frame(frame, 5) is None


def test_decode_frame_returns_definition_and_values():
    frame, values = decode_frame(CanFrame(0x705, b"\x05"), 5)
    assert (frame.name, values) == ("Heartbeat", {"node_state": "operational"})


def test_a_wrong_length_raises_an_error():
    with pytest.raises(ValueError, match=r"Force .* 8 bytes, not 3"):
        decode(FORCE, bytes(3))
