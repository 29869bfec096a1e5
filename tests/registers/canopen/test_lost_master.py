"""A CANopen node on a whole instrument whose master goes away: nothing inflates while nobody watches."""

import pytest

from instrument.coupling import Coupling
from instrument.events.witness import Nowhere, Witness
from registers.can.options import Options
from registers.can.wire import CanFrame
from registers.canopen.node import CanopenNode
from tests.instrument.driving import HOLD_8, PLC, ROBOT, VENT, Drive
from tests.registers.canopen.talking import IDENTITY, frame_of

WATCH, NO_WATCH = "605 23 16 10 01 F4 01 7F 00", "605 23 16 10 01"  # node 127, 500 ms
HEARTBEAT, BOOT_UP = "77F 05", "77F 00"


class Bench:
    """A held balloon, and a node whose master has just been lost."""

    def __init__(self):
        self.drive = Drive.holding(ROBOT)
        self.node = CanopenNode(Witness(Coupling(self.drive.instrument), Nowhere()), Options(), IDENTITY)
        self.run(0.1)
        self.say(WATCH, HEARTBEAT)
        self.run(0.4)
        assert self.drive.inflates
        self.run(1.0)

    def say(self, *frames):
        return [f for said in frames for f in self.node.receive(frame_of(said), self.drive.now_s)]

    def run(self, seconds):
        for _ in range(round(seconds / 0.01)):
            self.drive.run(0.01)
            self.node.tick(self.drive.now_s)

    def ask_to_inflate(self, peer):
        """Clear, vent, hold, in the order of the rules; what became of the clear."""
        cleared = self.drive.order("clear_faults", peer=peer)
        self.drive.write(VENT, peer)
        self.drive.write(HOLD_8, peer)
        return cleared


@pytest.mark.parametrize("peer", [ROBOT, PLC])
def test_nothing_inflates_while_the_master_is_lost_whoever_asks(peer):
    bench = Bench()
    for _ in range(3):
        assert bench.ask_to_inflate(peer) == ("failed", "cause_persists")
        assert not bench.drive.inflates
        assert bench.drive.see().first_fault == 41
        bench.run(1.0)


def test_a_clear_by_command_frame_says_that_the_cause_persists():
    bench = Bench()
    bench.say("000 01 05")
    answers = [f for f in bench.say("205 00 00 02 07 00 00 00 00") if f.id == 0x485]
    assert [f.data[:2] for f in answers] == [bytes((7, 16 + 5))]


@pytest.mark.parametrize("back", [HEARTBEAT, WATCH, NO_WATCH])
def test_once_the_cause_is_gone_the_way_back_is_open_and_nothing_inflates_by_itself(back):
    bench = Bench()
    bench.say(back)
    bench.run(0.1)
    assert (bench.drive.see().state, bench.drive.inflates) == ("tripped", False)
    bench.say(back)  # the deadline is running again
    assert bench.ask_to_inflate(ROBOT) == ("done", "none")
    assert bench.drive.inflates


@pytest.mark.parametrize("said", [BOOT_UP, "77E 05", "000 81 05", "000 82 00"])
def test_neither_a_boot_up_nor_another_node_nor_a_reset_is_the_master(said):
    bench = Bench()
    bench.say(said)
    bench.run(0.1)
    assert bench.ask_to_inflate(ROBOT) == ("failed", "cause_persists")


def test_a_master_lost_again_while_its_first_loss_is_cleared_keeps_the_fault():
    bench = Bench()
    bench.say(HEARTBEAT)
    bench.run(0.45)
    bench.node.receive(CanFrame(0, b"\x01\x05"), bench.drive.now_s)
    bench.say("205 00 00 02 07 00 00 00 00")
    bench.run(0.6)
    assert bench.drive.see().first_fault == 41
