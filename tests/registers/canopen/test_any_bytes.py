"""Tests with random bytes on the bus. No exception is raised, and each written value is within its range."""

import struct

from hypothesis import given
from hypothesis import strategies as st

from pneuforce.registers.can.wire import CanFrame, FrameKind
from pneuforce.registers.canopen.communication import COMMUNICATION
from pneuforce.registers.canopen.object_dictionary import ENTRIES
from pneuforce.registers.map import REGISTERS
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.fake_master import FakeMaster

ADDRESSED = [0x000, 0x080, 0x085, 0x185, 0x205, 0x585, 0x605, 0x705, 0x77F]
kinds = st.sampled_from([FrameKind.DATA] * 6 + [FrameKind.REMOTE, FrameKind.EXTENDED, FrameKind.ERROR])
frames = st.builds(CanFrame, st.sampled_from(ADDRESSED), st.binary(max_size=8), kinds)
addresses = st.sampled_from([entry.address for entry in ENTRIES])
requests = st.builds(
    lambda head, at, data: CanFrame(0x605, struct.pack("<BHB", head, *at) + data),
    st.sampled_from(
        [0x40, 0x20, 0x21, 0x22, 0x23, 0x27, 0x2B, 0x2F, 0x60, 0x70, 0x00, 0x10, 0x80, 0x07, 0x17]
    ),
    addresses,
    st.binary(min_size=4, max_size=4),
)
BY_QUANTITY = {}
for register in REGISTERS:
    if register.writable:
        BY_QUANTITY.setdefault(register.quantity, []).append(register)


def within_the_ranges(written):
    return all(
        any(register.accepts(register.encode(value)) for register in BY_QUANTITY[quantity])
        for quantity, value in written.items()
    )


@given(st.lists(frames | requests, max_size=40), st.sampled_from([PRE, OPERATIONAL, STOPPED]))
def test_any_bytes_raise_no_exception_and_written_values_are_within_their_range(step, state):
    master = FakeMaster(state)
    for frame in step:
        for answer in master.node.receive(frame, master.now_s):
            assert not answer.kind
            assert answer.id in (0x085, 0x185, 0x285, 0x385, 0x485, 0x585, 0x705)
        master.now_s += 0.01
        master.node.tick(master.now_s)
    assert all(within_the_ranges(written) for written in master.source.written)


@given(st.lists(requests, max_size=60))
def test_after_any_requests_the_server_responds_and_every_parameter_is_allowed(step):
    master = FakeMaster()
    for frame in step:
        master.node.receive(frame, master.now_s)
    for entry in (entry for object_ in COMMUNICATION for entry in object_.entries if entry.writable):
        (answer,) = master.send(
            f"605 40 {entry.index & 0xFF:02X} {entry.index >> 8:02X} {entry.subindex:02X}"
        )
        assert answer.data[0] & 0xF3 == 0x43
        entry.decode(answer.data[4 : 4 + entry.type.size], 5)


@given(st.binary(max_size=8))
def test_a_remote_or_extended_request_is_ignored(data):
    master = FakeMaster(OPERATIONAL)
    for can_id in ADDRESSED:
        for kind in (FrameKind.REMOTE, FrameKind.EXTENDED):
            assert master.node.receive(CanFrame(can_id, data, kind), 0.0) == []
    assert master.source.written == []
