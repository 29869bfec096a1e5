"""Tests of write requests as hex texts. The source receives the whole request, only its vent, or nothing."""

import pytest

from tests.registers.modbus.memory_source import AT_REST, MemorySource
from tests.registers.modbus.pdu_requests import PLC, answer, spaced

WRITTEN = ("setpoint_requested_kpa", "force_limit_n", "mode", "lease_s", "reference_pressure_kpa")
ACCEPTED_WRITES = [
    ("06 0204 0001", "06 0204 0001", {"mode": "hold"}),
    ("06 0220 1f40", "06 0220 1f40", {"setpoint_requested_kpa": 8.0}),
    ("06 0221 07d0", "06 0221 07d0", {"force_limit_n": 2.0}),
    ("10 0200 0002 04 41000000", "10 0200 0002", {"setpoint_requested_kpa": 8.0}),
    ("10 0200 0005 0a 41000000 40000000 0001", "10 0200 0005",
     {"setpoint_requested_kpa": 8.0, "force_limit_n": 2.0, "mode": "hold"}),
    ("10 0208 0004 08 5046 0002 0000 0007", "10 0208 0004",
     {"command_key": 0x5046, "command_code": "clear_faults", "command_argument": 0, "command_sequence": 7}),
    ("16 0204 fffe 0001", "16 0204 fffe 0001", {"mode": "hold"}),
    ("16 0220 00ff 1000", "16 0220 00ff 1000", {"setpoint_requested_kpa": 0x1088 / 1000}),  # 5000 is 1388h
    ("17 0200 0002 0200 0002 04 41000000", "17 04 41000000", {"setpoint_requested_kpa": 8.0}),
    ("17 0000 0002 0204 0001 02 0001", "17 04 3fa00000", {"mode": "hold"}),
]  # fmt: skip

REJECTED_WRITES = [
    ("06 0200 4100", "86 03"),  # half of the setpoint
    ("06 0201 0000", "86 03"),
    ("06 0204 0002", "86 03"),  # no such mode
    ("06 0220 07cf", "86 03"),  # 1999 Pa
    ("06 0220 2ee1", "86 03"),  # 12001 Pa
    ("06 0220 ffff", "86 03"),  # "not available"
    ("06 0000 0000", "86 02"),  # read-only
    ("06 0019 0000", "86 02"),
    ("06 020f 0000", "86 02"),  # reserved
    ("06 2710 0000", "86 02"),
    ("06 ffff 0000", "86 02"),
    ("06 0220", "86 03"),
    ("06 0204 00", "86 03"),  # an incomplete vent
    ("06 0220 1f40 00", "86 03"),
    ("10 0200 0002 04 00004100", "90 03"),  # words swapped
    ("10 0200 0002 04 7fc00000", "90 03"),  # NaN
    ("10 0200 0002 04 7f800000", "90 03"),  # infinity
    ("10 0200 0002 04 ff800000", "90 03"),
    ("10 0200 0002 04 bf800000", "90 03"),  # -1
    ("10 0200 0002 04 414028f6", "90 03"),  # 12.01 kPa
    ("10 0200 0002 04 00000000", "90 03"),
    ("10 0200 0002 03 410000", "90 03"),  # byte count is not twice the quantity
    ("10 0200 0002 06 41000000 0000", "90 03"),
    ("10 0200 0002 04 4100", "90 03"),  # fewer bytes than the byte count
    ("10 0200 0002 04 41000000 00", "90 03"),
    ("10 0200 0000 00", "90 03"),
    ("10 0200 0080 00", "90 03"),
    ("10 0200 007c f8 " + "0000" * 124, "90 03"),
    ("10 0200", "90 03"),
    ("10 0200 0003 06 41000000 4000", "90 03"),  # only half of the last value
    ("10 0200 0004 08 41000000 7fc00000", "90 03"),  # the second value is invalid: the first is not written
    ("10 01ff 0003 06 0000 41000000", "90 02"),
    ("10 0228 0004 08 0064 07d0 0000 0000", "90 02"),
    ("10 01ff 0003 06 0000 7fc00000", "90 02"),  # the address is checked before the value
    ("10 ffff 0002 04 00000000", "90 02"),
    ("16 0200 0000 4100", "96 03"),  # half of a long value
    ("16 0204 0000 0002", "96 03"),
    ("16 0000 ffff 0000", "96 02"),
    ("16 0018 ffff 0000", "96 02"),
    ("16 020f ffff 0000", "96 02"),
    ("16 2710 ffff 0000", "96 02"),
    ("16 0204 ffff", "96 03"),
    ("17 0000 0000 0200 0002 04 41000000", "97 03"),
    ("17 0000 007e 0200 0002 04 41000000", "97 03"),
    ("17 0000 0002 0200 0000 00", "97 03"),
    ("17 0000 0002 0200 007a f4 " + "0000" * 122, "97 03"),
    ("17 0000 0002 0200 0002 03 410000", "97 03"),
    ("17 0000 0002 0200 0002 04 4100", "97 03"),
    ("17 0080 0002 0200 0002 04 41000000", "97 02"),  # the read is rejected, so nothing is written
    ("17 ffff 0002 0200 0002 04 41000000", "97 02"),
    ("17 0000 0002 0000 0002 04 41000000", "97 02"),
    ("17 0000 0002 0200 0002 04 7fc00000", "97 03"),
    ("17 0000 0002", "97 03"),
    ("05 0000 ff00", "85 02"),  # there are no coils
    ("05 0000 0000", "85 02"),
    ("05 0000 0001", "85 03"),
    ("05 0204 ffff", "85 03"),
    ("05 0000", "85 03"),
    ("0f 0000 000a 02 ffff", "8f 02"),
    ("0f 0000 000a 01 ff", "8f 03"),
    ("0f 0000 000a 02 ff", "8f 03"),
    ("0f 0000 0000 00", "8f 03"),
    ("0f 0000 07b1 f7 " + "00" * 247, "8f 03"),
    ("0f 0000", "8f 03"),
]

VENTS = [
    ("06 0204 0000", "06 0204 0000"),
    ("10 0204 0001 02 0000", "10 0204 0001"),
    ("16 0204 0000 0000", "16 0204 0000 0000"),
    ("16 0204 fffe 0000", "16 0204 fffe 0000"),
    ("17 0000 0002 0204 0001 02 0000", "17 04 3fa00000"),
]

VENTS_IN_REJECTED_WRITES = [
    ("10 0202 0003 06 7fc00000 0000", "90 03"),  # invalid force limit
    ("10 0203 0002 04 0000 0000", "90 03"),  # half of a force limit
    ("10 0204 0002 04 0000 0001", "90 03"),  # lease too short
    ("10 01ff 0006 0c 0000 41000000 40000000 0000", "90 02"),
    ("10 0204 0009 12 " + "0000" * 9, "90 02"),  # includes read-only registers
    ("17 0080 0001 0204 0001 02 0000", "97 02"),  # the read is rejected
]


def test_a_mask_write_changes_single_bits():
    """Example of the specification: 12h with AND mask F2h and OR mask 25h gives 17h."""
    source = MemorySource()
    source.values["command_argument"] = 0x12
    assert answer("16 020a 00f2 0025", source) == "16 02 0a 00 f2 00 25"
    assert source.write_requests == [{"command_argument": 0x17}]


@pytest.mark.parametrize(("request_", "expected", "written"), ACCEPTED_WRITES)
def test_a_write_is_one_request_to_the_source(request_, expected, written):
    source = MemorySource()
    assert answer(request_, source) == spaced(expected)
    assert source.write_requests == [pytest.approx(written)]


@pytest.mark.parametrize(("request_", "expected"), REJECTED_WRITES)
def test_a_rejected_write_changes_nothing(request_, expected):
    source = MemorySource()
    assert answer(request_, source) == spaced(expected)
    assert source.write_requests == []
    assert {name: source.values[name] for name in WRITTEN} == {name: AT_REST[name] for name in WRITTEN}


@pytest.mark.parametrize(
    "request_",
    ["06 0204 0001", "10 0200 0002 04 41000000", "16 0204 0000 0001", "17 0000 0002 0204 0001 02 0001"],
)
def test_a_write_that_the_source_rejects_is_answered_with_06(request_):
    source = MemorySource(reject=lambda peer, values: "state")
    assert answer(request_, source) == f"{int(request_[:2], 16) | 0x80:x} 06"
    assert answer("03 001b 0001", source) == "03 02 00 01", "register 27 contains the reject reason"
    assert source.values["mode"] == "vent"


@pytest.mark.parametrize(("request_", "expected"), VENTS)
@pytest.mark.parametrize("read_only", [False, True])
def test_a_vent_is_never_rejected(request_, expected, read_only):
    source = MemorySource(reject=lambda peer, values: "lease")
    source.values["mode"] = "hold"
    assert answer(request_, source, read_only) == spaced(expected)
    assert source.write_requests == [{"mode": "vent"}]


@pytest.mark.parametrize(("request_", "expected"), VENTS_IN_REJECTED_WRITES)
@pytest.mark.parametrize("read_only", [False, True])
def test_a_vent_in_a_rejected_write_is_carried_out(request_, expected, read_only):
    source = MemorySource()
    source.values["mode"] = "hold"
    assert answer(request_, source, read_only) == (expected[:3] + "01" if read_only else expected)
    assert source.write_requests == [{"mode": "vent"}]


def test_a_read_only_server_carries_out_only_the_vent_of_a_request():
    source = MemorySource()
    assert answer("10 0204 0002 04 0000 00c8", source, read_only=True) == "90 01"
    assert source.write_requests == [{"mode": "vent"}]


def test_a_vent_reaches_the_source_with_the_rest_of_an_acceptable_request():
    source = MemorySource(reject=lambda peer, values: "lease")
    source.values["mode"] = "hold"
    assert answer("10 0200 0005 0a 41000000 40000000 0000", source) == "90 06"
    assert source.write_requests == [{"setpoint_requested_kpa": 8.0, "force_limit_n": 2.0, "mode": "vent"}]
    assert source.values["mode"] == "vent"


@pytest.mark.parametrize("request_", [request for request, *_ in ACCEPTED_WRITES + REJECTED_WRITES])
def test_a_read_only_server_rejects_all_write_functions(request_):
    source = MemorySource()
    assert answer(request_, source, read_only=True) == f"{int(request_[:2], 16) | 0x80:x} 01"
    assert source.write_requests == []


@pytest.mark.parametrize("request_", ["17 0000 0002 0204 0001 02 0000", "16 0204 0000 0000"])
def test_a_vent_needs_no_snapshot(request_):
    class SourceWithoutSnapshot(MemorySource):
        def snapshot(self, peer, now_s):
            raise ZeroDivisionError

    source = SourceWithoutSnapshot()
    answer(request_, source)
    assert source.write_requests == [{"mode": "vent"}]


def test_a_log_error_is_answered_with_04_and_nothing_changes():
    class SourceWithFailingLog(MemorySource):
        def log_rejected_write(self, peer, rejected, now_s):
            raise OSError("no space left")

    source = SourceWithFailingLog()
    assert answer("06 0204 0002", source) == "86 04"
    assert source.write_requests == []
    assert answer("06 0204 0000", source) == "06 02 04 00 00"


def test_the_source_receives_the_peer():
    seen = []
    source = MemorySource(reject=lambda peer, values: seen.append(peer) or "none")
    answer("06 0204 0001", source)
    assert seen == [PLC]
