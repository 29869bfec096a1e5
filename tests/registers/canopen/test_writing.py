"""What reaches the instrument from a CANopen master, and what does not."""

import math
import struct

import pytest

from registers.can.wire import Kind
from registers.canopen.dictionary import ENTRIES
from registers.codes import REFUSALS
from registers.map import REGISTERS
from tests.registers.can.rig import Rig
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.talking import Master, agrees, frame_of, told

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


@pytest.mark.parametrize(("said", "written"), WRITES, ids=[str(row[1]) for row in WRITES])
def test_a_written_register_is_asked_of_the_instrument(said, written):
    master = Master()
    (answer,) = master.say(said)
    assert answer.data[0] == 0x60
    assert master.rig.written == [written]


@pytest.mark.parametrize("state", [PRE, OPERATIONAL, STOPPED])
def test_a_vent_by_pdo_passes_in_every_state(state):
    master = Master(state)
    master.rig.refusal = "lease"
    master.say(VENT_BY_PDO)
    assert VENT.items() <= master.rig.written[-1].items()


def test_a_vent_passes_even_before_the_boot_up_and_with_the_rpdo_off():
    master = Master(OPERATIONAL)
    master.say("605 23 00 14 01 05 02 00 80")
    master.say(VENT_BY_PDO)
    assert master.rig.written


@pytest.mark.parametrize("state", [PRE, OPERATIONAL])
@pytest.mark.parametrize("said", [VENT_BY_SDO, "605 2F 10 28 02 00"])
def test_a_vent_by_sdo_passes_wherever_there_is_sdo(state, said):
    master = Master(state)
    master.say(said)
    assert master.rig.written == [VENT]


@pytest.mark.parametrize(
    "said", ["205 40 1F 01 01 00 00 00 00", "205 00 00 02 01 00 00 00 00", "205 00 00 00 01"]
)
@pytest.mark.parametrize("state", [PRE, STOPPED])
def test_nothing_but_a_whole_vent_is_taken_outside_operational(state, said):
    master = Master(state)
    assert master.say(said) == []
    assert master.rig.written == []
    assert master.node.counters.ignored == 1


VENTS = [
    VENT_BY_PDO,
    VENT_BY_SDO,
    "605 22 04 22 00",
    "605 2F 10 28 02",
]
NO_VENTS = [
    "205 00 00 01 01 00 00 00 00",
    "205 00 00 00 01 00 00 00",
    "605 2B 04 22 00 01",
    "605 23 04 22 00",  # too long
    "605 2B 04 22 01",  # no such sub-index
    "605 21 04 22 00 02",  # in segments
    "605 40 04 22 00",
    "605 2B 05 22 00",
    "605 2F 10 28 03",
    "605 2B 34 12 00",
    "605 2B 04 22 00 00 !",
    "606 2B 04 22 00 00 00 00 00",
    "585 2B 04 22 00 00 00 00 00",
    "000 02 05",
]


@pytest.mark.parametrize("said", VENTS + NO_VENTS)
@pytest.mark.parametrize("state", [PRE, OPERATIONAL])
def test_what_is_taken_for_a_vent_in_a_flood_is_what_vents(state, said):
    master = Master(state)
    frame = frame_of(said)
    assert master.node.is_vent(frame) == (said in VENTS)
    assert not master.node.is_vent(frame._replace(kind=Kind.EXTENDED))
    master.say(said)
    vented = any(VENT.items() <= written.items() for written in master.rig.written)
    assert vented == (said in VENTS)


def test_a_stopped_node_takes_no_vent_by_sdo_and_so_lets_none_push_a_command_out():
    master = Master(STOPPED)
    assert not master.node.is_vent(frame_of(VENT_BY_SDO))
    assert master.node.is_vent(frame_of(VENT_BY_PDO))


NMT = ["000 01 05", "000 02 05", "000 80 05", "000 81 05", "000 82 00"]


@pytest.mark.parametrize("said", NMT)
@pytest.mark.parametrize("state", [PRE, OPERATIONAL, STOPPED])
def test_no_nmt_command_asks_anything_of_the_instrument(state, said):
    master = Master(state)
    master.say(said)
    master.wait(1.0)
    assert (master.rig.written, master.rig.masters_lost) == ([], [])


@pytest.mark.parametrize("refusal", [name for name in REFUSALS.codes if name != "none"])
def test_a_refusal_says_whether_it_is_for_the_asker_or_for_the_state(refusal):
    master = Master()
    master.rig.refusal = refusal
    frames = master.say("605 2B 04 22 00 01")
    code = "21" if refusal in ("lease", "write_lock") else "22"
    assert agrees(f"585 80 04 22 00 {code} 00 00 08", frames), told(frames)


def test_what_is_out_of_limits_is_told_to_whoever_keeps_a_log_and_goes_no_further():
    master = Master()
    master.say("605 23 00 22 00 00 00 48 41")
    master.say("605 23 00 20 00 00 00 00 00")
    master.say("605 2F 29 10 01 03")  # a parameter of the bus
    assert master.rig.written == []
    assert master.rig.turned_away == [
        (bytes.fromhex("002200 00004841"), "value too high"),
        (bytes.fromhex("002000"), "attempt to write a read-only object"),
    ]


def test_a_malformed_command_is_told_to_whoever_keeps_a_log():
    master = Master(OPERATIONAL)
    master.say("205 40 1F 01")
    assert master.rig.turned_away == [(bytes.fromhex("401f01"), "length")]


def test_an_order_that_takes_time_is_answered_when_it_has_ended():
    master = Master(OPERATIONAL)
    master.rig.set(answer_state="busy")
    assert master.say("205 00 00 02 07 00 00 00 00") == []
    assert [f for _, f in master.wait(0.5) if f.id == 0x485] == []
    master.rig.set(answer_state="failed", answer_result="cause_persists")
    (answer,) = [f for _, f in master.wait(0.5) if f.id == 0x485]
    assert answer.data[:2] == bytes((7, 16 + 5))


@pytest.mark.parametrize(
    ("now", "status"),
    [
        ({"status": frozenset({"force_valid", "force_limit"}), "pressure_kpa": 8.0}, (2, 0)),
        ({"status": frozenset({"overpressure"}), "pressure_kpa": 26.0}, (1, 2)),
        ({"status": frozenset(), "pressure_kpa": math.nan}, (1, 1)),
    ],
)
def test_the_status_of_each_channel_says_valid_and_above(now, status):
    master = Master(rig=Rig(**now))
    assert tuple(master.say(f"605 40 50 61 0{sub}")[0].data[4] for sub in (1, 2)) == status


def test_a_segmented_write_asks_once_and_whole():
    master = Master()
    master.say("605 21 00 22 00 04")
    master.say("605 0A 00 00")
    assert master.rig.written == []
    master.say("605 1B 00 41")
    assert master.rig.written == [{"setpoint_requested_kpa": 8.0}]


def test_a_segmented_write_that_is_given_up_writes_nothing():
    master = Master()
    master.say("605 21 00 22 00 04")
    master.say("605 0A 00 00")
    master.wait(3.0)
    master.say("605 1B 00 41")
    assert master.rig.written == []


def test_a_lost_master_is_told_once_and_again_only_after_it_came_back():
    master = Master()
    master.say("605 23 16 10 01 F4 01 7F 00")
    master.wait(2.0)
    assert master.rig.masters_lost == []
    master.say("77F 05")
    master.wait(2.0)
    assert master.rig.masters_lost == [pytest.approx(2.51)]
    master.say("77F 05")
    master.wait(0.4)
    assert len(master.rig.masters_lost) == 1
    master.wait(1.0)
    assert len(master.rig.masters_lost) == 2


@pytest.mark.parametrize("back", ["77F 05", "605 23 16 10 01 F4 01 7F 00", "605 23 16 10 01"])
def test_a_lost_master_is_back_with_its_heartbeat_or_when_the_watch_is_written_anew(back):
    master = Master()
    for said in ("605 23 16 10 01 F4 01 7F 00", "77F 05"):
        master.say(said)
    master.wait(2.0)
    for said in ("605 40 16 10 01", "77E 05", "77F 00", "000 81 05", "000 01 05"):
        master.say(said)
    assert master.rig.masters_back == []
    master.say(back)
    assert master.rig.masters_back == [pytest.approx(2.0)]


def test_a_master_that_ends_its_watch_is_not_lost():
    master = Master()
    master.say("605 23 16 10 01 F4 01 7F 00")
    master.say("77F 05")
    master.say("605 23 16 10 01")
    master.wait(2.0)
    assert master.rig.masters_lost == []


@pytest.mark.parametrize(
    "entry", [e for e in ENTRIES if e.access in ("ro", "const")], ids=lambda e: str(e.at)
)
def test_what_is_read_only_cannot_be_written(entry):
    master = Master()
    head = f"605 2F {entry.index & 0xFF:02X} {entry.index >> 8:02X} {entry.sub:02X} 00"
    (answer,) = master.say(head)
    assert answer.data[4:] == (0x0601_0002).to_bytes(4, "little")


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda e: str(e.at))
def test_every_entry_can_be_read_but_an_error_that_was_not(entry):
    master = Master()
    head = f"605 40 {entry.index & 0xFF:02X} {entry.index >> 8:02X} {entry.sub:02X}"
    (answer,) = master.say(head)
    none_yet = entry.index == 0x1003 and entry.sub
    assert (answer.data[0] == 0x80) == bool(none_yet)


def test_every_register_reads_as_its_field_renders_the_snapshot():
    rig = Rig(pressure_kpa=8.25, age_s=0.004, status=frozenset({"holding", "calibrated"}), balloon_id=70000)
    master = Master(rig=rig)
    for register in REGISTERS:
        value = register.constant if register.quantity == "" else getattr(rig.now, register.quantity)
        code = value if register.quantity == "" else register.encode(value)
        low, high = register.address & 0xFF, 0x20 + (register.address >> 8)
        (answer,) = master.say(f"605 40 {low:02X} {high:02X} 00")
        assert answer.data[4:].startswith(struct.pack("<" + register.wire.code, code)), register.name
