"""What carries one of our identifiers and is not obeyed is counted; what is others' business is not."""

import pytest

from registers.can.wire import CanFrame, Kind
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.talking import Master, frame_of

IGNORED = [
    (PRE, "000"),
    (PRE, "000 01"),
    (PRE, "000 01 05 00"),
    (PRE, "000 03 05"),
    (OPERATIONAL, "080 07 07"),
    (PRE, "080 07 07"),
    (PRE, "605 !"),
    (PRE, "605 40 00 10 00 !"),
    (STOPPED, "605 40 00 10 00"),
    (PRE, "205 40 1F 01 01 00 00 00 00"),
    (OPERATIONAL, "185 00"),
    (OPERATIONAL, "585 00"),
    (OPERATIONAL, "705 05"),
]
#: Obeyed, or meant for all or for others.
NOT_IGNORED = [
    (PRE, "000 01 06"),
    (PRE, "000 01 00"),
    (PRE, "080"),
    (OPERATIONAL, "080 07"),
    (PRE, "605 40 00 10 00"),
    (PRE, "605 80 00 10 00"),
    (STOPPED, "205 00 00 00 01 00 00 00 00"),
    (OPERATIONAL, "205 40 1F 01 01 00 00 00 00"),
    (OPERATIONAL, "186 00"),
]


@pytest.mark.parametrize(("state", "said"), IGNORED)
def test_what_is_not_obeyed_is_counted(state, said):
    master = Master(state)
    assert master.say(said) == []
    assert master.node.counters.ignored == 1


@pytest.mark.parametrize(("state", "said"), NOT_IGNORED)
def test_what_is_obeyed_or_others_business_is_not_counted(state, said):
    master = Master(state)
    master.say(said)
    assert master.node.counters.ignored == 0


@pytest.mark.parametrize("can_id", [0x000, 0x080, 0x205, 0x605, 0x705])
@pytest.mark.parametrize("kind", [Kind.REMOTE, Kind.EXTENDED])
def test_a_remote_or_extended_frame_is_counted_once(can_id, kind):
    master = Master(OPERATIONAL)
    assert master.node.receive(CanFrame(can_id, b"\x01\x05", kind), 0.0) == []
    assert master.node.counters.ignored == 1


@pytest.mark.parametrize("vent", ["205 00 00 00 01 00 00 00 00", "605 2B 04 22 00 00"])
def test_what_looks_like_a_vent_in_a_frame_of_another_kind_is_none(vent):
    node, frame = Master(OPERATIONAL).node, frame_of(vent)
    assert node.is_vent(frame)
    assert not any(node.is_vent(frame._replace(kind=kind)) for kind in (Kind.REMOTE, Kind.EXTENDED))
