"""Tests of the events that trigger TPDOs. The TPDO is sent with the sample that contains the event."""

import pytest

from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen.node import CanopenNode
from tests.registers.can.fake_source import FakeSource
from tests.registers.can.test_node import CHANGES, STALE
from tests.registers.canopen.cases import OPERATIONAL
from tests.registers.canopen.fake_master import IDENTITY, FakeMaster

IDS = {"State": 0x285, "Status": 0x385}


@pytest.fixture
def master():
    """Return the master of an operational node, at a time between two cyclic TPDOs."""
    master = FakeMaster(OPERATIONAL)
    master.wait(0.33, samples=True)
    return master


def at_sample(master):
    master.now_s += 0.002
    return [frame.id for frame in master.node.on_sample(master.now_s)]


@pytest.mark.parametrize(("name", "change"), CHANGES)
def test_a_change_is_sent_with_the_next_sample_not_with_the_next_cycle(master, name, change):
    assert IDS[name] not in at_sample(master)
    master.source.set(**change)
    assert IDS[name] in at_sample(master)
    assert IDS[name] not in [frame.id for _, frame in master.wait(0.05, samples=True)]


def test_a_complete_peak_triggers_state_and_the_start_of_a_contact_does_not(master):
    master.source.set(status=master.source.now.status | {"in_contact"}, contact_counter=1)
    assert IDS["State"] not in at_sample(master)
    master.source.set(peak_counter=1, peak_force_n=2.0)
    assert IDS["State"] in at_sample(master)


def test_a_setpoint_that_stays_not_available_does_not_trigger_state():
    master = FakeMaster(OPERATIONAL, source=FakeSource())
    sent = [frame.id for _, frame in master.wait(1.0, samples=True)]
    assert sent.count(IDS["State"]) == 10


def test_the_heartbeat_is_sent_without_samples_too():
    master = FakeMaster()
    master.source.set(status=STALE)
    assert [f.data for _, f in master.wait(3.5) if f.id == 0x705] == 3 * [b"\x7f"]


def test_after_a_pause_missed_heartbeats_are_not_sent():
    master = FakeMaster()
    master.now_s = 10.3
    assert [f.id for f in master.node.tick(master.now_s)] == [0x705]
    heartbeats_s = [now_s for now_s, f in master.wait(2.5) if f.id == 0x705]
    assert heartbeats_s == [pytest.approx(11.3), pytest.approx(12.3)]


def test_commands_before_the_boot_up_are_ignored():
    node = CanopenNode(FakeSource(), CanOptions(), IDENTITY)
    assert node.receive(CanFrame(0, b"\x01\x05"), 0.0) == []
    assert [frame.data for frame in node.tick(0.0)] == [b"\x00"]
    assert [f.data for f in node.tick(1.0)] == [b"\x7f"]


def test_events_before_the_start_are_not_sent_after_it():
    master = FakeMaster()
    master.send("605 2F 02 18 02 00")  # transmission type 0: sent at the SYNC after an event
    master.source.set(state="venting")
    master.wait(0.1)
    master.send("000 01 05")
    assert master.send("080") == []


def test_a_node_accepts_only_its_own_identifiers_and_the_heartbeat_of_its_master(master):
    accepted = {can_id for can_id in range(0x800) if master.node.accepts(CanFrame(can_id))}
    node_ids = {base + 5 for base in (0x080, 0x180, 0x200, 0x280, 0x380, 0x480, 0x500, 0x580, 0x600, 0x700)}
    assert accepted == node_ids | {0x000, 0x080, 0x7E5}
    master.send("605 23 16 10 01 F4 01 7F 00")
    assert master.node.accepts(CanFrame(0x77F))
