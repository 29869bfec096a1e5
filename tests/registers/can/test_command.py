"""Commands as a robot sends them, in rows: what was sent before, what is sent, what becomes of it."""

import pytest

from instrument.core import Instrument, Settings
from registers.can.frames import ANSWER, COMMAND, decode, encode
from registers.can.node import CanNode
from registers.can.options import Options
from registers.can.wire import CanFrame, Kind
from registers.map import COMMAND_KEY
from tests.registers.can.rig import Rig

HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "reserved": 0}
HELD = {"mode": "hold", "setpoint_requested_kpa": 8.0, "lease_s": 0.0}


def command(**changes):
    return CanFrame(0x205, encode(COMMAND, None, **(HOLD | changes)))


def raw(data, kind=Kind.DATA, can_id=0x205):
    return CanFrame(can_id, bytes.fromhex(data), kind)


def answers(node, *frames, now_s=0.0):
    replies = [node.receive(frame, now_s) for frame in frames][-1]
    assert all(reply.id == 0x485 for reply in replies)
    return [(v["sequence"], v["result"]) for v in (decode(ANSWER, reply.data) for reply in replies)]


@pytest.fixture
def rig():
    return Rig(setpoint_kpa=8.0)


@pytest.fixture
def node(rig):
    return CanNode(rig, Options())


def test_hold_writes_setpoint_mode_and_lease_at_once(node, rig):
    assert answers(node, command(lease=1.5)) == [(1, "accepted")]
    assert rig.written == [HELD | {"lease_s": 1.5}]


def test_the_answer_carries_the_setpoint_in_effect(node):
    (reply,) = node.receive(command(), 0.0)
    assert decode(ANSWER, reply.data)["setpoint"] == pytest.approx(8.0)


NOTHING_DONE = [
    ("too short for a sequence", [raw("401f01")], [(0, "length")]),
    ("empty", [raw("")], [(0, "length")]),
    ("too short", [raw("401f0107")], [(7, "length")]),
    ("a short vent", [raw("00000009")], [(9, "length")]),
    ("setpoint low", [raw("cf07 01 02 0000 0000")], [(2, "span")]),
    ("setpoint high", [raw("e12e 01 02 0000 0000")], [(2, "span")]),
    ("setpoint not available", [raw("ffff 01 02 0000 0000")], [(2, "span")]),
    ("lease short", [raw("401f 01 02 c700 0000")], [(2, "span")]),
    ("lease long", [raw("401f 01 02 61ea 0000")], [(2, "span")]),
    ("unknown mode", [raw("401f 04 02 0000 0000")], [(2, "span")]),
    ("reserved not 0", [raw("401f 01 02 0000 0100")], [(2, "span")]),
    ("clear with a setpoint out of span", [raw("0100 02 02 0000 0000")], [(2, "span")]),
    ("hold without a setpoint", [raw("0000 01 02 0000 0000")], [(2, "span")]),
    ("remote", [raw("", Kind.REMOTE)], []),
    ("extended", [raw("401f010100000000", Kind.EXTENDED)], []),
    ("error", [raw("401f010100000000", Kind.ERROR)], []),
    ("our own Force", [raw("401f010100000000", can_id=0x185)], []),
    ("another node's Command", [raw("401f010100000000", can_id=0x206)], []),
]


@pytest.mark.parametrize(("_name", "frames", "expected"), NOTHING_DONE, ids=[row[0] for row in NOTHING_DONE])
def test_what_is_not_a_good_command_changes_nothing(node, rig, _name, frames, expected):
    assert answers(node, *frames) == expected
    assert rig.written == []


def test_frames_with_our_numbers_that_are_none_to_obey_are_counted(node):
    for kind in (Kind.REMOTE, Kind.EXTENDED, Kind.ERROR):
        node.receive(raw("", kind), 0.0)
    node.receive(raw("00" * 8, can_id=0x185), 0.0)
    node.receive(raw("00" * 8, can_id=0x123), 0.0)
    assert node.counters.ignored == 4


def test_a_repeated_command_is_renewed_and_not_carried_out_again(node, rig):
    assert answers(node, command(), command(), command()) == [(1, "renewed")]
    assert rig.written == [HELD]


def test_a_repeated_command_renews_its_lease_and_does_only_that(node, rig):
    node.receive(command(lease=1.0), 0.0)
    rig.set(lease_holder="can", lease_s=1.0)
    assert answers(node, command(lease=1.0)) == [(1, "renewed")]
    assert rig.written[1:] == [{"lease_s": 1.0}]


def test_a_lease_that_is_lost_is_not_taken_again_by_repetition(node, rig):
    node.receive(command(lease=1.0), 0.0)
    rig.set(lease_holder="modbus_tcp")
    assert answers(node, command(lease=1.0)) == [(1, "refused_lease")]
    assert len(rig.written) == 1


def test_the_same_sequence_with_other_content_is_refused(node, rig):
    assert answers(node, command(), command(setpoint=9.0)) == [(1, "sequence")]
    assert rig.written == [HELD]


def test_a_new_sequence_is_carried_out(node, rig):
    assert answers(node, command(), command(sequence=2)) == [(2, "accepted")]
    assert rig.written == [HELD, HELD]


def test_a_bad_span_does_not_use_up_its_sequence(node):
    assert answers(node, raw("cf07 01 01 0000 0000"), command()) == [(1, "accepted")]


def test_a_refused_command_says_why_and_its_repetition_is_not_tried_again(node, rig):
    rig.refusal = "fault_latched"
    assert answers(node, command()) == [(1, "refused_fault_latched")]
    rig.refusal = "none"
    assert answers(node, command()) == [(1, "refused_fault_latched")]
    assert len(rig.written) == 1


VENTS = [
    ("in its span", "401f 00 05 0000 0000"),
    ("setpoint out of span", "0000 00 05 0000 0000"),
    ("everything out of span", "ffff 00 05 0100 ffff"),
    ("a stale sequence", "401f 00 01 0000 0000"),
]


@pytest.mark.parametrize(("_name", "data"), VENTS, ids=[row[0] for row in VENTS])
@pytest.mark.parametrize("refusal", ["none", "lease", "write_lock"])
def test_a_vent_is_never_refused(node, rig, _name, data, refusal):
    node.receive(command(), 0.0)
    rig.refusal = refusal
    (answer,) = answers(node, raw(data))
    assert answer[1] == "accepted"
    assert rig.written[-1]["mode"] == "vent"


def test_a_repeated_vent_vents_again(node, rig):
    vent = command(mode="vent")
    assert answers(node, vent, vent) == [(1, "renewed")]
    assert [w["mode"] for w in rig.written] == ["vent", "vent"]


def test_a_vent_in_its_span_stores_setpoint_and_lease(node, rig):
    node.receive(command(mode="vent", setpoint=9.0), 0.0)
    assert rig.written == [{"mode": "vent", "setpoint_requested_kpa": 9.0, "lease_s": 0.0}]


@pytest.mark.parametrize("mode", ["clear_faults", "zero_pressure"])
def test_an_order_goes_through_the_command_block_in_one_write(node, rig, mode):
    rig.set(command_sequence=0xFFFF)
    assert answers(node, command(mode=mode)) == [(1, "accepted")]
    assert rig.written == [
        {"command_key": COMMAND_KEY, "command_code": mode, "command_argument": 0, "command_sequence": 0}
    ]


def test_an_order_that_fails_at_once_says_why(node, rig):
    rig.set(answer_state="failed", answer_result="cause_persists")
    assert answers(node, command(mode="clear_faults")) == [(1, "refused_cause_persists")]


@pytest.mark.parametrize(
    ("ending", "result"),
    [
        ({"answer_state": "done"}, "accepted"),
        ({"answer_state": "failed", "answer_result": "cause_persists"}, "refused_cause_persists"),
    ],
)
def test_an_order_that_takes_time_is_answered_once_it_has_ended(node, rig, ending, result):
    rig.set(answer_state="busy")
    assert answers(node, command(mode="clear_faults")) == []
    assert not [frame for frame in node.tick(0.01) if frame.id == 0x485]
    rig.set(**ending)
    replies = [decode(ANSWER, frame.data) for frame in node.tick(0.02) if frame.id == 0x485]
    assert [(r["sequence"], r["result"]) for r in replies] == [(1, result)]
    assert not [frame for frame in node.tick(0.03) if frame.id == 0x485]


def test_the_real_instrument_takes_a_vent_and_refuses_to_inflate_without_a_rig():
    instrument = Instrument(Settings())
    node = CanNode(instrument, Options())
    assert answers(node, command()) == [(1, "refused_link_lost")]
    assert answers(node, command(mode="vent", sequence=2, lease=1.0)) == [(2, "accepted")]
    assert answers(node, command(mode="zero_pressure", sequence=3)) == [(3, "refused_link_lost")]
    assert instrument.snapshot(("can", ""), 0.0).lease_holder == "can"


@pytest.mark.parametrize(
    "state", [{"answer_state": "busy"}, {"answer_state": "failed", "answer_result": "cause_persists"}]
)
def test_a_hold_is_answered_at_once_whatever_became_of_somebody_elses_order(node, rig, state):
    rig.set(**state)
    assert answers(node, command()) == [(1, "accepted")]


def test_a_refused_order_is_answered_at_once_though_another_one_is_busy(node, rig):
    rig.set(answer_state="busy")
    rig.refusal = "write_lock"
    assert answers(node, command(mode="clear_faults")) == [(1, "refused_write_lock")]
    rig.set(answer_state="done")
    assert not [frame for frame in node.tick(0.01) if frame.id == 0x485]
