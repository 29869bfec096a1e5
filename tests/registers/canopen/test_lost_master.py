"""Tests of a node with a complete instrument. No client can inflate while the CANopen master is lost."""

import pytest

from pneuforce.instrument.audit.audit_logger import AuditLogger, NullAuditSink
from pneuforce.instrument.core.session import Session
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen.node import CanopenNode
from tests.instrument.instrument_harness import HOLD_8, PLC, ROBOT, VENT, InstrumentHarness
from tests.registers.canopen.fake_master import IDENTITY, parse_frame

#: SDO writes that set the heartbeat deadline of node 127 to 500 ms, or end the monitoring.
MONITOR_MASTER, END_MONITORING = "605 23 16 10 01 F4 01 7F 00", "605 23 16 10 01"
HEARTBEAT, BOOT_UP = "77F 05", "77F 00"


class LostMasterSetup:
    """Instrument with a held balloon, and a node whose master has just been lost."""

    def __init__(self):
        self.harness = InstrumentHarness.holding(ROBOT)
        self.node = CanopenNode(
            AuditLogger(Session(self.harness.instrument), NullAuditSink()), CanOptions(), IDENTITY
        )
        self.run(0.1)
        self.send(MONITOR_MASTER, HEARTBEAT)
        self.run(0.4)
        assert self.harness.commands_hold
        self.run(1.0)

    def send(self, *frames):
        """Send frames to the node and return its answers."""
        return [f for step in frames for f in self.node.receive(parse_frame(step), self.harness.now_s)]

    def run(self, seconds):
        """Let time pass for the instrument and the node."""
        for _ in range(round(seconds / 0.01)):
            self.harness.run(0.01)
            self.node.tick(self.harness.now_s)

    def try_to_inflate(self, peer):
        """Clear, vent and hold in the required order; return the result of the clear command."""
        cleared = self.harness.run_command("clear_faults", peer=peer)
        self.harness.write(VENT, peer)
        self.harness.write(HOLD_8, peer)
        return cleared


@pytest.mark.parametrize("peer", [ROBOT, PLC])
def test_nothing_inflates_while_the_master_is_lost_for_any_client(peer):
    setup = LostMasterSetup()
    for _ in range(3):
        assert setup.try_to_inflate(peer) == ("failed", "cause_persists")
        assert not setup.harness.commands_hold
        assert setup.harness.snapshot().first_out_fault == 41
        setup.run(1.0)


def test_a_clear_by_command_frame_fails_because_the_cause_persists():
    setup = LostMasterSetup()
    setup.send("000 01 05")
    answers = [f for f in setup.send("205 00 00 02 07 00 00 00 00") if f.id == 0x485]
    assert [f.data[:2] for f in answers] == [bytes((7, 16 + 5))]


@pytest.mark.parametrize("back", [HEARTBEAT, MONITOR_MASTER, END_MONITORING])
def test_after_the_cause_is_gone_the_fault_can_be_cleared_and_nothing_inflates_by_itself(back):
    setup = LostMasterSetup()
    setup.send(back)
    setup.run(0.1)
    assert (setup.harness.snapshot().state, setup.harness.commands_hold) == ("tripped", False)
    setup.send(back)  # restarts the heartbeat deadline
    assert setup.try_to_inflate(ROBOT) == ("done", "none")
    assert setup.harness.commands_hold


@pytest.mark.parametrize("step", [BOOT_UP, "77E 05", "000 81 05", "000 82 00"])
def test_a_boot_up_another_node_or_a_reset_does_not_recover_the_master(step):
    setup = LostMasterSetup()
    setup.send(step)
    setup.run(0.1)
    assert setup.try_to_inflate(ROBOT) == ("failed", "cause_persists")


def test_a_second_loss_of_the_master_sets_the_fault_again():
    setup = LostMasterSetup()
    setup.send(HEARTBEAT)
    setup.run(0.45)
    setup.node.receive(CanFrame(0, b"\x01\x05"), setup.harness.now_s)
    setup.send("205 00 00 02 07 00 00 00 00")
    setup.run(0.6)
    assert setup.harness.snapshot().first_out_fault == 41
