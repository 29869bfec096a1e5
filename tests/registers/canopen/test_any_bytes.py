"""Tests with random bytes on the bus. No exception is raised, and each written value is within its range."""

import struct
from concurrent.futures import Future

from hypothesis import given
from hypothesis import strategies as st

from pneuforce.registers.can.wire import CanFrame, FrameKind
from pneuforce.registers.canopen.communication import COMMUNICATION
from pneuforce.registers.canopen.object_dictionary import ENTRIES
from pneuforce.registers.canopen.parameter_storage import ParameterStorage
from pneuforce.registers.map import REGISTERS
from tests.registers.can.fake_source import FakeSource
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.fake_master import FakeMaster

ADDRESSED = [0x000, 0x080, 0x085, 0x185, 0x205, 0x585, 0x605, 0x705, 0x77F, 0x7E5]
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
SIGNATURES = [b"save", b"load", b"SAVE", bytes(4)]
stores = st.builds(
    lambda index, sub, signature: CanFrame(0x605, struct.pack("<BHB", 0x23, index, sub) + signature),
    st.sampled_from([0x1010, 0x1011]),
    st.integers(0, 3),
    st.sampled_from(SIGNATURES),
)
LSS_SERVICES = [0x04, 0x11, 0x13, 0x15, 0x17, *range(0x40, 0x52), *range(0x5A, 0x5F)]
lss_requests = st.builds(
    lambda service, value, data: CanFrame(0x7E5, bytes((service, value)) + data),
    st.sampled_from(LSS_SERVICES),
    st.sampled_from([0, 1, 7, 127, 128, 255]),
    st.binary(min_size=6, max_size=6),
)
#: LSS can change the node id to that of the monitored master.
OWN_HEARTBEAT = "the value of object 1016h:1 is not allowed"
BY_QUANTITY = {}
for register in REGISTERS:
    if register.writable:
        BY_QUANTITY.setdefault(register.quantity, []).append(register)


def within_the_ranges(written):
    return all(
        any(register.accepts(register.encode(value)) for register in BY_QUANTITY[quantity])
        for quantity, value in written.items()
    )


class MemoryFile:
    """Parameter file in memory that fails at each write whose number is in `failures`."""

    def __init__(self, failures=()):
        self.content = None
        self.writes = 0
        self._failures = failures

    def write(self, content):
        done = Future()
        self.writes += 1
        if self.writes in self._failures:
            done.set_exception(OSError("the disk is full"))
        else:
            self.content = content
            done.set_result(None)
        return done


@given(
    st.lists(frames | requests | stores | lss_requests, max_size=40),
    st.sampled_from([PRE, OPERATIONAL, STOPPED]),
    st.sampled_from([{"vented"}, {"holding"}]),
    st.sets(st.integers(1, 4)),
)
def test_any_bytes_raise_no_exception_and_written_values_are_within_their_range(
    step, state, status, failures
):
    file = MemoryFile(failures)
    source = FakeSource(status=frozenset(status), mode="vent", lease_s=0.0)
    master = FakeMaster(state, source, ParameterStorage(5, None, file.write))
    for frame in step:
        for answer in master.node.receive(frame, master.now_s):
            assert not answer.kind
            assert answer.id in master.node.transmit_ids | {0x7E4}
        master.now_s += 0.01
        master.node.tick(master.now_s)
    assert all(within_the_ranges(written) for written in master.source.written)
    assert master.node.options.node_id == 5 or "vented" in status
    if file.content is not None:
        storage = ParameterStorage(5, file.content, file.write)
        FakeMaster(storage=storage)
        assert storage.problem in ("", OWN_HEARTBEAT)


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
