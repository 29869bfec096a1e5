"""Tests of the Answer to mode 2 (clear) on CAN and CANopen when the cable of the rig is pulled."""

import pytest

from pneuforce.instrument.core.faults import HostFault
from pneuforce.registers.can.frames import ANSWER, COMMAND, decode, encode
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen.node import CanopenNode
from tests.instrument.instrument_harness import InstrumentHarness
from tests.registers.canopen.fake_master import IDENTITY

OPERATIONAL = CanFrame(0x000, bytes((1, 5)))
CLEAR = CanFrame(
    COMMAND.base_id + 5,
    encode(COMMAND, None, mode="clear_faults", sequence=1, setpoint=0.0, lease=0.0, proof_test="allowed"),
)


def nodes_of(harness):
    return (
        CanNode(harness.instrument, CanOptions()),
        CanopenNode(harness.instrument, CanOptions(), IDENTITY),
    )


@pytest.mark.parametrize("kind", [0, 1], ids=["raw", "canopen"])
@pytest.mark.parametrize("pulled_before_s", [0.2, 0.05, -0.05])
def test_the_answer_states_the_lost_link_instead_of_accepted(kind, pulled_before_s):
    harness = InstrumentHarness.zeroed()
    harness.instrument.trip(HostFault.BOARD_RESET)
    node = nodes_of(harness)[kind]
    node.tick(harness.now_s)
    node.receive(OPERATIONAL, harness.now_s)
    harness.run_without_samples(pulled_before_s)
    frames = node.receive(CLEAR, harness.now_s)
    harness.run(max(0.0, -pulled_before_s))
    for _ in range(60):
        harness.run_without_samples(0.01)
        frames += node.tick(harness.now_s)
    answers = [decode(ANSWER, frame.data) for frame in frames if frame.id == ANSWER.base_id + 5]
    assert [(answer["sequence"], answer["result"]) for answer in answers] == [(1, "rejected_link_lost")]
