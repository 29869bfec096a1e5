"""Tests of the RDT codec: the layout of ATI's manual, and records without a valid force."""

import math
import struct

import pytest

from pneuforce.registers.rdt.record import (
    COUNTS_PER_N,
    FULL_SCALE_COUNTS,
    STATUS_INVALID,
    STATUS_VALID,
    RdtCommand,
    RdtRecord,
    RdtRequest,
    decode_record,
    decode_request,
    encode_record,
    encode_request,
    force_record,
)


def test_a_request_has_the_layout_of_the_manual():
    assert encode_request(RdtCommand.START_REALTIME) == bytes.fromhex("1234 0002 0000 0000")
    assert encode_request(RdtCommand.SET_BIAS, 0x01020304) == bytes.fromhex("1234 0042 0102 0304")


def test_a_record_has_the_layout_of_the_manual():
    record = RdtRecord(0x01020304, 0x05060708, STATUS_INVALID, -1, 2, -3, 4, -5, 6)
    data = bytes.fromhex("01020304 05060708 80020000 ffffffff 00000002 fffffffd 00000004 fffffffb 00000006")
    assert encode_record(record) == data
    assert decode_record(data) == record


@pytest.mark.parametrize("command", [*RdtCommand, 5, 0xFFFF])
def test_a_request_is_decoded_as_it_was_encoded(command):
    assert decode_request(encode_request(command, 7)) == RdtRequest(command, 7)


@pytest.mark.parametrize(
    "data",
    [b"", b"\x12\x34", b"\x12\x34\0\2\0\0\0", b"\x12\x34\0\2\0\0\0\0\0", b"\x34\x12\2\0\0\0\0\0", b"\0" * 8],
    ids=["empty", "header only", "short", "long", "little-endian", "no header"],
)
def test_a_malformed_request_is_none(data):
    assert decode_request(data) is None


@pytest.mark.parametrize("length", [0, 35, 37, 72])
def test_a_record_of_another_length_is_an_error(length):
    with pytest.raises(ValueError, match=str(length)):
        decode_record(bytes(length))


@pytest.mark.parametrize("force_n", [0.0, 1.5, -0.25, 3.141592653589793, 19.999999])
def test_the_force_is_fz_and_all_other_axes_are_zero(force_n):
    record = decode_record(encode_record(force_record(1, 2, force_n)))
    assert (record.rdt_sequence, record.ft_sequence, record.status) == (1, 2, STATUS_VALID)
    assert record.is_valid
    assert abs(record.force_n - force_n) <= 0.5 / COUNTS_PER_N
    assert (record.fx, record.fy, record.tx, record.ty, record.tz) == (0, 0, 0, 0, 0)


@pytest.mark.parametrize("force_n", [math.nan, math.inf, -math.inf, 2147.483647, -2147.483647, 1e300])
def test_a_force_that_is_not_valid_is_serious_and_at_full_scale(force_n):
    record = decode_record(encode_record(force_record(1, 2, force_n)))
    assert (record.status, record.fz) == (STATUS_INVALID, FULL_SCALE_COUNTS)
    assert not record.is_valid
    assert math.isnan(record.force_n)


@pytest.mark.parametrize("status", [STATUS_INVALID, 0x80010000, 1])
def test_a_record_with_any_status_has_no_force(status):
    data = struct.pack(">III6i", 1, 2, status, 0, 0, 1_000_000, 0, 0, 0)
    assert math.isnan(decode_record(data).force_n)


def test_counters_wrap():
    record = force_record(2**32, 2**32 + 5, 0.0)
    assert (record.rdt_sequence, record.ft_sequence) == (0, 5)
