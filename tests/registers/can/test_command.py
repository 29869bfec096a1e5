"""Tests of Commands: their results, and the writes that they cause."""

import pytest

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.settings import Settings
from pneuforce.protocol.frames import Fault
from pneuforce.registers.can.frames import ANSWER, COMMAND, decode, encode
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame, FrameKind
from pneuforce.registers.map import COMMAND_KEY
from tests.instrument.instrument_harness import PLC, ROBOT, InstrumentHarness
from tests.registers.can.fake_source import FakeSource

HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "proof_test": "allowed"}
HELD = {"mode": "hold", "setpoint_requested_kpa": 8.0, "lease_s": 0.0, "proof_test": "allowed"}


def command(**changes):
    return CanFrame(0x205, encode(COMMAND, None, **(HOLD | changes)))


def raw(data, kind=FrameKind.DATA, can_id=0x205):
    return CanFrame(can_id, bytes.fromhex(data), kind)


def answers(node, *frames, now_s=0.0):
    """Send all frames. Return the sequence number and the result of each Answer to the last frame."""
    replies = [node.receive(frame, now_s) for frame in frames][-1]
    assert all(reply.id == 0x485 for reply in replies)
    return [(v["sequence"], v["result"]) for v in (decode(ANSWER, reply.data) for reply in replies)]


@pytest.fixture
def source():
    return FakeSource(setpoint_kpa=8.0)


@pytest.fixture
def node(source):
    return CanNode(source, CanOptions())


def test_hold_writes_setpoint_mode_and_lease_at_once(node, source):
    assert answers(node, command(lease=1.5)) == [(1, "accepted")]
    assert source.written == [HELD | {"lease_s": 1.5}]


def test_a_lease_writes_only_the_lease_each_time_and_whatever_its_sequence_number(node, source):
    lease = raw("0000 04 02 e803 0000")
    assert answers(node, lease, lease) == [(2, "accepted")]
    assert source.written == [{"lease_s": 1.0}] * 2


def test_a_lease_between_a_command_and_its_repetition_does_not_repeat_the_command(node, source):
    hold, lease = command(lease=1.0), raw("0000 04 09 e803 0000")
    source.set(lease_holder="can", lease_s=1.0)
    node.receive(hold, 0.0)
    node.receive(lease, 0.0)
    assert answers(node, hold) == [(1, "renewed")]
    assert [written.get("mode") for written in source.written] == ["hold", None, None]


def test_a_lease_is_rejected_while_another_bus_has_the_lease(leased_hold):
    harness, node = leased_hold
    node.receive(raw("0000 00 03 0000 0000"), harness.now_s)  # vent, and end the lease
    assert harness.instrument.write(PLC, {"lease_s": 1.0}, harness.now_s) == "none"
    assert answers(node, raw("0000 04 04 e803 0000"), now_s=harness.now_s) == [(4, "rejected_lease")]


def test_the_answer_carries_the_setpoint_in_effect(node):
    (reply,) = node.receive(command(), 0.0)
    assert decode(ANSWER, reply.data)["setpoint"] == pytest.approx(8.0)


INVALID_COMMANDS = [
    ("too short for a sequence", [raw("401f01")], [(0, "invalid_length")]),
    ("empty", [raw("")], [(0, "invalid_length")]),
    ("too short", [raw("401f0107")], [(7, "invalid_length")]),
    ("a short vent", [raw("00000009")], [(9, "invalid_length")]),
    ("setpoint low", [raw("cf07 01 02 0000 0000")], [(2, "out_of_range")]),
    ("setpoint high", [raw("e12e 01 02 0000 0000")], [(2, "out_of_range")]),
    ("setpoint not available", [raw("ffff 01 02 0000 0000")], [(2, "out_of_range")]),
    ("lease short", [raw("401f 01 02 c700 0000")], [(2, "out_of_range")]),
    ("lease long", [raw("401f 01 02 61ea 0000")], [(2, "out_of_range")]),
    ("unknown mode", [raw("401f 05 02 0000 0000")], [(2, "out_of_range")]),
    ("unknown proof test", [raw("401f 01 02 0000 0200")], [(2, "out_of_range")]),
    ("clear with a setpoint out of range", [raw("0100 02 02 0000 0000")], [(2, "out_of_range")]),
    ("hold without a setpoint", [raw("0000 01 02 0000 0000")], [(2, "out_of_range")]),
    ("remote", [raw("", FrameKind.REMOTE)], []),
    ("extended", [raw("401f010100000000", FrameKind.EXTENDED)], []),
    ("error", [raw("401f010100000000", FrameKind.ERROR)], []),
    ("this node's Force", [raw("401f010100000000", can_id=0x185)], []),
    ("another node's Command", [raw("401f010100000000", can_id=0x206)], []),
]


@pytest.mark.parametrize(
    ("_name", "frames", "expected"), INVALID_COMMANDS, ids=[row[0] for row in INVALID_COMMANDS]
)
def test_an_invalid_command_changes_nothing(node, source, _name, frames, expected):
    assert answers(node, *frames) == expected
    assert source.written == []


def test_ignored_frames_with_an_identifier_of_this_node_are_counted(node):
    for kind in (FrameKind.REMOTE, FrameKind.EXTENDED, FrameKind.ERROR):
        node.receive(raw("", kind), 0.0)
    node.receive(raw("00" * 8, can_id=0x185), 0.0)
    node.receive(raw("00" * 8, can_id=0x123), 0.0)
    assert node.counters.ignored == 4


def test_a_repeated_command_is_renewed_and_not_carried_out_again(node, source):
    assert answers(node, command(), command(), command()) == [(1, "renewed")]
    assert source.written == [HELD]


def test_a_repeated_command_renews_its_lease_and_does_nothing_else(node, source):
    node.receive(command(lease=1.0), 0.0)
    source.set(lease_holder="can", lease_s=1.0)
    assert answers(node, command(lease=1.0)) == [(1, "renewed")]
    assert source.written[1:] == [{"lease_s": 1.0}]


def test_a_repeated_command_does_not_take_a_lost_lease_again(node, source):
    node.receive(command(lease=1.0), 0.0)
    assert answers(node, command(lease=1.0)) == [(1, "rejected_state")]
    assert len(source.written) == 1


@pytest.fixture
def leased_hold():
    """Return a harness that holds 8 kPa with a lease of CAN, and its node."""
    harness = InstrumentHarness.ready()
    node = CanNode(harness.instrument, CanOptions())
    assert answers(node, command(lease=1.0), now_s=harness.now_s) == [(1, "accepted")]
    harness.run(0.9)
    assert answers(node, command(lease=1.0), now_s=harness.now_s) == [(1, "renewed")]
    return harness, node


def test_a_renewal_after_the_lease_has_expired_reports_the_latched_fault(leased_hold):
    harness, node = leased_hold
    harness.run(1.1)
    assert answers(node, command(lease=1.0), now_s=harness.now_s) == [(1, "rejected_fault_latched")]
    assert harness.snapshot(ROBOT).lease_holder == "none"
    assert harness.snapshot(ROBOT).reject_reason == "fault_latched"


def test_a_renewal_for_a_tripped_rig_is_rejected_and_lets_the_lease_end(leased_hold):
    harness, node = leased_hold
    harness.causes = {Fault.OVERPRESSURE}
    harness.run(0.1)
    for _ in range(5):
        assert answers(node, command(lease=1.0), now_s=harness.now_s) == [(1, "rejected_fault_latched")]
        harness.run(0.3)
    assert harness.snapshot(ROBOT).lease_holder == "none"


def test_a_renewal_after_another_client_has_taken_the_lease_reports_the_lease(leased_hold):
    harness, node = leased_hold
    harness.run(1.1)
    harness.write_ok({"lease_s": 5.0}, PLC)
    assert answers(node, command(lease=1.0), now_s=harness.now_s) == [(1, "rejected_lease")]


def test_the_same_sequence_with_other_content_is_rejected(node, source):
    assert answers(node, command(), command(setpoint=9.0)) == [(1, "sequence_reused")]
    assert source.written == [HELD]


def test_a_new_sequence_is_carried_out(node, source):
    assert answers(node, command(), command(sequence=2)) == [(2, "accepted")]
    assert source.written == [HELD, HELD]


def test_a_command_out_of_range_does_not_use_its_sequence(node):
    assert answers(node, raw("cf07 01 01 0000 0000"), command()) == [(1, "accepted")]


def test_a_rejected_command_returns_the_reason_and_its_repetition_is_not_carried_out(node, source):
    source.reject_reason = "fault_latched"
    assert answers(node, command()) == [(1, "rejected_fault_latched")]
    source.reject_reason = "none"
    assert answers(node, command()) == [(1, "rejected_fault_latched")]
    assert len(source.written) == 1


VENTS = [
    ("in range", "401f 00 05 0000 0000"),
    ("setpoint out of range", "0000 00 05 0000 0000"),
    ("all fields out of range", "ffff 00 05 0100 ffff"),
    ("a used sequence", "401f 00 01 0000 0000"),
]


@pytest.mark.parametrize(("_name", "data"), VENTS, ids=[row[0] for row in VENTS])
@pytest.mark.parametrize("reject_reason", ["none", "lease", "write_protect"])
def test_a_vent_is_never_rejected(node, source, _name, data, reject_reason):
    node.receive(command(), 0.0)
    source.reject_reason = reject_reason
    (answer,) = answers(node, raw(data))
    assert answer[1] == "accepted"
    assert source.written[-1]["mode"] == "vent"


def test_a_repeated_vent_vents_again(node, source):
    vent = command(mode="vent")
    assert answers(node, vent, vent) == [(1, "renewed")]
    assert [w["mode"] for w in source.written] == ["vent", "vent"]


def test_a_vent_in_range_stores_setpoint_and_lease(node, source):
    node.receive(command(mode="vent", setpoint=9.0), 0.0)
    assert source.written == [HELD | {"mode": "vent", "setpoint_requested_kpa": 9.0}]


@pytest.mark.parametrize("mode", ["clear_faults", "zero_pressure"])
def test_a_command_of_the_command_block_is_one_write(node, source, mode):
    source.set(command_sequence=0xFFFF)
    assert answers(node, command(mode=mode)) == [(1, "accepted")]
    assert source.written == [
        {"command_key": COMMAND_KEY, "command_code": mode, "command_argument": 0, "command_sequence": 0}
    ]


def test_a_command_that_fails_at_once_returns_the_reason(node, source):
    source.set(answer_state="failed", answer_result="cause_persists")
    assert answers(node, command(mode="clear_faults")) == [(1, "rejected_cause_persists")]


@pytest.mark.parametrize(
    ("ending", "result"),
    [
        ({"answer_state": "done"}, "accepted"),
        ({"answer_state": "failed", "answer_result": "cause_persists"}, "rejected_cause_persists"),
    ],
)
def test_a_command_that_takes_time_is_answered_when_it_has_finished(node, source, ending, result):
    source.set(answer_state="busy")
    assert answers(node, command(mode="clear_faults")) == []
    assert not [frame for frame in node.tick(0.01) if frame.id == 0x485]
    source.set(**ending)
    replies = [decode(ANSWER, frame.data) for frame in node.tick(0.02) if frame.id == 0x485]
    assert [(r["sequence"], r["result"]) for r in replies] == [(1, result)]
    assert not [frame for frame in node.tick(0.03) if frame.id == 0x485]


def test_a_repeated_command_is_not_answered_before_it_has_finished(node, source):
    source.set(answer_state="busy")
    for _ in range(3):
        assert answers(node, command(mode="clear_faults")) == []
    source.set(answer_state="failed", answer_result="cause_persists")
    replies = [decode(ANSWER, frame.data) for frame in node.tick(0.02) if frame.id == 0x485]
    assert [(r["sequence"], r["result"]) for r in replies] == [(1, "rejected_cause_persists")]
    assert answers(node, command(mode="clear_faults")) == [(1, "rejected_cause_persists")]


def test_the_real_instrument_accepts_a_vent_and_rejects_a_hold_without_a_rig():
    instrument = Instrument(Settings())
    node = CanNode(instrument, CanOptions())
    assert answers(node, command()) == [(1, "rejected_link_lost")]
    assert answers(node, command(mode="vent", sequence=2, lease=1.0)) == [(2, "accepted")]
    assert answers(node, command(mode="zero_pressure", sequence=3)) == [(3, "rejected_link_lost")]
    assert instrument.snapshot(("can", ""), 0.0).lease_holder == "can"


@pytest.mark.parametrize(
    "state", [{"answer_state": "busy"}, {"answer_state": "failed", "answer_result": "cause_persists"}]
)
def test_a_hold_is_answered_at_once_while_a_command_of_another_client_is_busy_or_failed(node, source, state):
    source.set(**state)
    assert answers(node, command()) == [(1, "accepted")]


def test_a_rejected_command_is_answered_at_once_while_another_one_is_busy(node, source):
    source.set(answer_state="busy")
    source.reject_reason = "write_protect"
    assert answers(node, command(mode="clear_faults")) == [(1, "rejected_write_protect")]
    source.set(answer_state="done")
    assert not [frame for frame in node.tick(0.01) if frame.id == 0x485]


def test_a_command_can_forbid_proof_tests(node, source):
    assert answers(node, command(proof_test="forbidden")) == [(1, "accepted")]
    assert source.written == [HELD | {"proof_test": "forbidden"}]


def test_a_node_that_renews_its_hold_does_not_inflate_after_the_vent_of_another_node(node, source):
    mine, vent = command(lease=1.0), command(mode="vent", sequence=77, setpoint=0.0)
    assert answers(node, mine) == [(1, "accepted")]
    assert answers(node, mine, vent) == [(77, "accepted")]
    source.written.clear()
    assert answers(node, mine) == [(1, "sequence_reused")]
    assert answers(node, vent, mine) == [(1, "sequence_reused")]
    assert not any(write.get("mode") == "hold" for write in source.written)


def test_after_a_vent_a_hold_with_a_new_sequence_number_inflates(node, source):
    assert answers(node, command(), command(mode="vent", sequence=2, setpoint=0.0)) == [(2, "accepted")]
    assert answers(node, command(sequence=3)) == [(3, "accepted")]
    assert source.written[-1] == HELD


def test_a_hold_that_was_rejected_before_a_vent_is_not_executed_after_it(node, source):
    """A node that repeats its hold can be older than the host process, which rejects this hold."""
    source.reject_reason = "state"
    assert answers(node, command())[0][1].startswith("rejected")
    source.reject_reason = "none"
    vent = command(mode="vent", sequence=2, setpoint=0.0)
    assert answers(node, vent, command()) == [(1, "sequence_reused")]
    assert answers(node, vent, command(sequence=3)) == [(3, "accepted")]
