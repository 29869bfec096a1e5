"""Whatever a bus may carry: nothing raises, and nothing is written but whole and within its limits."""

import struct

from hypothesis import given
from hypothesis import strategies as st

from registers.can.wire import CanFrame, Kind
from registers.canopen.communication import COMMUNICATION
from registers.canopen.dictionary import ENTRIES
from registers.map import REGISTERS
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.talking import Master

ADDRESSED = [0x000, 0x080, 0x085, 0x185, 0x205, 0x585, 0x605, 0x705, 0x77F]
kinds = st.sampled_from([Kind.DATA] * 6 + [Kind.REMOTE, Kind.EXTENDED, Kind.ERROR])
frames = st.builds(CanFrame, st.sampled_from(ADDRESSED), st.binary(max_size=8), kinds)
places = st.sampled_from([entry.at for entry in ENTRIES])
requests = st.builds(
    lambda head, at, data: CanFrame(0x605, struct.pack("<BHB", head, *at) + data),
    st.sampled_from(
        [0x40, 0x20, 0x21, 0x22, 0x23, 0x27, 0x2B, 0x2F, 0x60, 0x70, 0x00, 0x10, 0x80, 0x07, 0x17]
    ),
    places,
    st.binary(min_size=4, max_size=4),
)
BY_QUANTITY = {}
for register in REGISTERS:
    if register.writable:
        BY_QUANTITY.setdefault(register.quantity, []).append(register)


def within_the_spans(written):
    return all(
        any(register.accepts(register.encode(value)) for register in BY_QUANTITY[quantity])
        for quantity, value in written.items()
    )


@given(st.lists(frames | requests, max_size=40), st.sampled_from([PRE, OPERATIONAL, STOPPED]))
def test_no_bytes_raise_and_what_is_written_is_within_its_span(said, state):
    master = Master(state)
    for frame in said:
        for answer in master.node.receive(frame, master.now_s):
            assert not answer.kind
            assert answer.id in (0x185, 0x285, 0x385, 0x485, 0x585, 0x705)
        master.now_s += 0.01
        master.node.tick(master.now_s)
    assert all(within_the_spans(written) for written in master.rig.written)


@given(st.lists(requests, max_size=60))
def test_after_any_dialogue_the_server_answers_and_every_parameter_is_one_that_is_allowed(said):
    master = Master()
    for frame in said:
        master.node.receive(frame, master.now_s)
    for entry in (entry for made in COMMUNICATION for entry in made.entries if entry.writable):
        (answer,) = master.say(f"605 40 {entry.index & 0xFF:02X} {entry.index >> 8:02X} {entry.sub:02X}")
        assert answer.data[0] & 0xF3 == 0x43
        entry.decode(answer.data[4 : 4 + entry.type.size], 5)


@given(st.binary(max_size=8))
def test_a_remote_or_extended_request_is_not_obeyed(data):
    master = Master(OPERATIONAL)
    for can_id in ADDRESSED:
        for kind in (Kind.REMOTE, Kind.EXTENDED):
            assert master.node.receive(CanFrame(can_id, data, kind), 0.0) == []
    assert master.rig.written == []
