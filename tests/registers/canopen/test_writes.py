"""Tests of the writes of a CANopen master: valid writes and vents reach the instrument."""

import struct

import pytest

from pneuforce.registers.can.wire import FrameKind
from pneuforce.registers.canopen.abort import AbortCode
from pneuforce.registers.canopen.communication import PDO_MAPPINGS
from pneuforce.registers.canopen.object_dictionary import ENTRIES
from pneuforce.registers.codes import REJECT_REASONS
from pneuforce.registers.map import REGISTERS
from tests.registers.can.fake_source import FakeSource
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.fake_master import FakeMaster, format_frames, frames_match, parse_frame

VENT = {"mode": "vent"}
VENT_BY_PDO = "205 00 00 00 01 00 00 00 00"
VENT_BY_SDO = "605 2B 04 22 00 00 00"

WRITES = [
    ("605 23 00 22 00 00 00 00 41", {"setpoint_requested_kpa": 8.0}),
    ("605 2B 20 22 00 40 1F", {"setpoint_requested_kpa": 8.0}),
    ("605 2B 04 22 00 01", {"mode": "hold"}),
    ("605 2B 05 22 00 E8 03", {"lease_s": 1.0}),
    ("605 2B 05 22 00 00", {"lease_s": 0.0}),
    ("605 2B 08 22 00 46 50", {"command_key": 0x5046}),
    ("605 2B 09 22 00 02", {"command_code": "clear_faults"}),
    ("605 23 02 22 00 00 00 00 40", {"force_limit_n": 2.0}),
]


@pytest.mark.parametrize(("step", "written"), WRITES, ids=[str(row[1]) for row in WRITES])
def test_a_write_to_a_register_reaches_the_instrument(step, written):
    master = FakeMaster()
    (answer,) = master.send(step)
    assert answer.data[0] == 0x60
    assert master.source.written == [written]


@pytest.mark.parametrize("state", [PRE, OPERATIONAL, STOPPED])
def test_a_vent_by_pdo_is_carried_out_in_every_state(state):
    master = FakeMaster(state)
    master.source.reject_reason = "lease"
    master.send(VENT_BY_PDO)
    assert VENT.items() <= master.source.written[-1].items()


def test_a_vent_is_carried_out_with_the_rpdo_disabled():
    master = FakeMaster(OPERATIONAL)
    master.send("605 23 00 14 01 05 02 00 80")
    master.send(VENT_BY_PDO)
    assert master.source.written


@pytest.mark.parametrize("state", [PRE, OPERATIONAL])
@pytest.mark.parametrize("step", [VENT_BY_SDO, "605 2F 10 28 02 00"])
def test_a_vent_by_sdo_is_carried_out_in_every_state_with_sdo(state, step):
    master = FakeMaster(state)
    master.send(step)
    assert master.source.written == [VENT]


@pytest.mark.parametrize(
    "step", ["205 40 1F 01 01 00 00 00 00", "205 00 00 02 01 00 00 00 00", "205 00 00 00 01"]
)
@pytest.mark.parametrize("state", [PRE, STOPPED])
def test_outside_operational_only_a_complete_vent_is_carried_out(state, step):
    master, states = FakeMaster(state), {PRE: "pre_operational", STOPPED: "stopped"}
    assert master.send(step) == []
    assert master.source.written == []
    assert [reason for _, reason in master.source.rejected_writes] == [f"node_{states[state]}"]


def test_a_command_to_a_disabled_rpdo_is_logged_with_its_own_reason():
    master = FakeMaster(OPERATIONAL)
    master.send("605 23 00 14 01 05 02 00 80")
    assert master.send("205 40 1F 01 01 00 00 00 00") == []
    assert master.source.written == []
    assert [reason for _, reason in master.source.rejected_writes] == ["rpdo1_disabled"]


VENTS = [
    VENT_BY_PDO,
    VENT_BY_SDO,
    "605 22 04 22 00",
    "605 2F 10 28 02",
]
OTHER_FRAMES = [
    "205 00 00 01 01 00 00 00 00",
    "205 00 00 00 01 00 00 00",
    "605 2B 04 22 00 01",
    "605 23 04 22 00",  # 4 bytes for a register of 2 bytes
    "605 2B 04 22 01",  # no such sub-index
    "605 21 04 22 00 02",  # segmented download
    "605 40 04 22 00",
    "605 2B 05 22 00",
    "605 2F 10 28 03",
    "605 2B 34 12 00",
    "605 2B 04 22 00 00 !",
    "606 2B 04 22 00 00 00 00 00",
    "585 2B 04 22 00 00 00 00 00",
    "000 02 05",
]


@pytest.mark.parametrize("step", VENTS + OTHER_FRAMES)
@pytest.mark.parametrize("state", [PRE, OPERATIONAL])
def test_is_vent_is_true_exactly_for_the_frames_that_vent(state, step):
    master = FakeMaster(state)
    frame = parse_frame(step)
    assert master.node.is_vent(frame) == (step in VENTS)
    assert not master.node.is_vent(frame._replace(kind=FrameKind.EXTENDED))
    master.send(step)
    vented = any(VENT.items() <= written.items() for written in master.source.written)
    assert vented == (step in VENTS)


def test_for_a_stopped_node_a_vent_by_sdo_is_not_a_vent():
    master = FakeMaster(STOPPED)
    assert not master.node.is_vent(parse_frame(VENT_BY_SDO))
    assert master.node.is_vent(parse_frame(VENT_BY_PDO))


NMT = ["000 01 05", "000 02 05", "000 80 05", "000 81 05", "000 82 00"]


@pytest.mark.parametrize("step", NMT)
@pytest.mark.parametrize("state", [PRE, OPERATIONAL, STOPPED])
def test_no_nmt_command_writes_to_the_instrument(state, step):
    master = FakeMaster(state)
    master.send(step)
    master.wait(1.0)
    assert (master.source.written, master.source.masters_lost_s) == ([], [])


@pytest.mark.parametrize("reject_reason", [name for name in REJECT_REASONS.codes if name != "none"])
def test_the_abort_code_depends_on_the_reject_reason(reject_reason):
    master = FakeMaster()
    master.source.reject_reason = reject_reason
    frames = master.send("605 2B 04 22 00 01")
    code = "21" if reject_reason in ("lease", "write_protect") else "22"
    assert frames_match(f"585 80 04 22 00 {code} 00 00 08", frames), format_frames(frames)


def test_a_rejected_write_to_a_register_is_logged_and_does_not_reach_the_instrument():
    master = FakeMaster()
    master.send("605 23 00 22 00 00 00 48 41")
    master.send("605 23 00 20 00 00 00 00 00")
    master.send("605 2F 29 10 01 03")  # a communication parameter
    assert master.source.written == []
    assert master.source.rejected_writes == [
        (bytes.fromhex("002200 00004841"), AbortCode.TOO_HIGH.meaning),
        (bytes.fromhex("002000 00000000"), AbortCode.READ_ONLY.meaning),
    ]


@pytest.mark.parametrize(
    ("step", "request_", "abort_code"),
    [
        ("605 2B 00 50 00 34 12", "005000 3412", AbortCode.NO_OBJECT),
        ("605 2F 10 28 09 01", "102809 01", AbortCode.NO_SUBINDEX),
        ("605 2F 12 10 00 01", "121000 01", AbortCode.NO_OBJECT),  # TIME: not supported
        ("605 21 00 20 00 04", "002000", AbortCode.READ_ONLY),  # segmented: the value never arrives
        ("605 21 00 22 00 05", "002200", AbortCode.TOO_LONG),
    ],
)
def test_a_write_to_a_missing_or_read_only_object_is_logged_with_its_bytes(step, request_, abort_code):
    master = FakeMaster()
    master.send(step)
    assert master.source.rejected_writes == [(bytes.fromhex(request_), abort_code.meaning)]


def test_a_read_of_a_missing_object_is_not_logged_as_a_write():
    master = FakeMaster()
    master.send("605 40 00 50 00")
    assert master.source.rejected_writes == []


def test_a_malformed_command_is_logged():
    master = FakeMaster(OPERATIONAL)
    master.send("205 40 1F 01")
    assert master.source.rejected_writes == [(bytes.fromhex("401f01"), "invalid_length")]


def test_a_command_that_takes_time_is_answered_when_it_has_finished():
    master = FakeMaster(OPERATIONAL)
    master.source.set(answer_state="busy")
    assert master.send("205 00 00 02 07 00 00 00 00") == []
    assert [f for _, f in master.wait(0.5) if f.id == 0x485] == []
    master.source.set(answer_state="failed", answer_result="cause_persists")
    (answer,) = [f for _, f in master.wait(0.5) if f.id == 0x485]
    assert answer.data[:2] == bytes((7, 16 + 5))


def test_a_segmented_write_reaches_the_instrument_once_and_complete():
    master = FakeMaster()
    master.send("605 21 00 22 00 04")
    master.send("605 0A 00 00")
    assert master.source.written == []
    master.send("605 1B 00 41")
    assert master.source.written == [{"setpoint_requested_kpa": 8.0}]


def test_a_segmented_write_that_times_out_writes_nothing():
    master = FakeMaster()
    master.send("605 21 00 22 00 04")
    master.send("605 0A 00 00")
    master.wait(3.0)
    master.send("605 1B 00 41")
    assert master.source.written == []


def test_a_lost_master_is_reported_once_and_again_after_it_has_recovered():
    master = FakeMaster()
    master.send("605 23 16 10 01 F4 01 7F 00")
    master.wait(2.0)
    assert master.source.masters_lost_s == []
    master.send("77F 05")
    master.wait(2.0)
    assert master.source.masters_lost_s == [pytest.approx(2.51)]
    master.send("77F 05")
    master.wait(0.4)
    assert len(master.source.masters_lost_s) == 1
    master.wait(1.0)
    assert len(master.source.masters_lost_s) == 2


@pytest.mark.parametrize("back", ["77F 05", "605 23 16 10 01 F4 01 7F 00", "605 23 16 10 01"])
def test_a_lost_master_recovers_by_its_heartbeat_or_by_a_write_to_the_heartbeat_time(back):
    master = FakeMaster()
    for step in ("605 23 16 10 01 F4 01 7F 00", "77F 05"):
        master.send(step)
    master.wait(2.0)
    for step in ("605 40 16 10 01", "77E 05", "77F 00", "000 81 05", "000 01 05"):
        master.send(step)
    assert master.source.masters_recovered_s == []
    master.send(back)
    assert master.source.masters_recovered_s == [pytest.approx(2.0)]


def test_a_master_that_ends_its_monitoring_is_not_lost():
    master = FakeMaster()
    master.send("605 23 16 10 01 F4 01 7F 00")
    master.send("77F 05")
    master.send("605 23 16 10 01")
    master.wait(2.0)
    assert master.source.masters_lost_s == []


@pytest.mark.parametrize(
    "entry", [e for e in ENTRIES if e.access in ("ro", "const")], ids=lambda e: str(e.address)
)
def test_a_read_only_entry_cannot_be_written(entry):
    master = FakeMaster()
    head = f"605 2F {entry.index & 0xFF:02X} {entry.index >> 8:02X} {entry.subindex:02X} 00"
    (answer,) = master.send(head)
    is_mapped_object = entry.index in PDO_MAPPINGS and entry.subindex
    assert answer.data[4:] == (0x0601_0000 if is_mapped_object else 0x0601_0002).to_bytes(4, "little")


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda e: str(e.address))
def test_every_entry_can_be_read_except_an_empty_error_history_and_autozero(entry):
    master = FakeMaster()
    head = f"605 40 {entry.index & 0xFF:02X} {entry.index >> 8:02X} {entry.subindex:02X}"
    (answer,) = master.send(head)
    empty_history = entry.index == 0x1003 and entry.subindex
    assert (answer.data[0] == 0x80) == (bool(empty_history) or entry.access == "wo")


def test_every_register_has_the_encoded_value_of_the_snapshot():
    source = FakeSource(
        pressure_kpa=8.25, age_s=0.004, status=frozenset({"holding", "calibrated"}), balloon_id=70000
    )
    master = FakeMaster(source=source)
    for register in REGISTERS:
        value = register.constant if register.quantity == "" else getattr(source.now, register.quantity)
        code = value if register.quantity == "" else register.encode(value)
        low, high = register.address & 0xFF, 0x20 + (register.address >> 8)
        (answer,) = master.send(f"605 40 {low:02X} {high:02X} 00")
        assert answer.data[4:].startswith(struct.pack("<" + register.wire.code, code)), register.name
