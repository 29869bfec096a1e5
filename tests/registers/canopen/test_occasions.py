"""What each TPDO is sent for, and when: as raw mode does, at the sample that shows it."""

import pytest

from registers.can.options import Options
from registers.can.wire import CanFrame
from registers.canopen.node import CanopenNode
from tests.registers.can.rig import Rig
from tests.registers.can.test_node import CHANGES, STALE
from tests.registers.canopen.cases import OPERATIONAL
from tests.registers.canopen.talking import IDENTITY, Master

IDS = {"State": 0x285, "Status": 0x385}


@pytest.fixture
def master():
    """One that has started the node, and waits between two cycles."""
    master = Master(OPERATIONAL)
    master.wait(0.33, samples=True)
    return master


def at_sample(master):
    master.now_s += 0.002
    return [frame.id for frame in master.node.on_sample(master.now_s)]


@pytest.mark.parametrize(("name", "change"), CHANGES)
def test_a_change_is_told_with_the_next_sample_not_with_the_next_cycle(master, name, change):
    assert IDS[name] not in at_sample(master)
    master.rig.set(**change)
    assert IDS[name] in at_sample(master)
    assert IDS[name] not in [frame.id for _, frame in master.wait(0.05, samples=True)]


def test_a_finished_contact_is_told_at_once_and_a_begun_one_is_not_in_state(master):
    free = master.rig.now.status
    master.rig.set(status=free | {"in_contact"}, contact_counter=1)
    assert IDS["State"] not in at_sample(master)
    master.rig.set(status=free, peak_force_n=2.0)
    assert IDS["State"] in at_sample(master)


def test_a_contact_that_ends_as_the_next_begins_is_told_too(master):
    master.rig.set(status=master.rig.now.status | {"in_contact"}, contact_counter=1)
    at_sample(master)
    master.rig.set(contact_counter=2, peak_force_n=2.0)
    assert IDS["State"] in at_sample(master)


def test_a_setpoint_that_stays_not_available_is_no_change():
    master = Master(OPERATIONAL, rig=Rig())
    sent = [frame.id for _, frame in master.wait(1.0, samples=True)]
    assert sent.count(IDS["State"]) == 10


def test_the_heartbeat_beats_without_samples_too():
    master = Master()
    master.rig.set(status=STALE)
    assert [f.data for _, f in master.wait(3.5) if f.id == 0x705] == 3 * [b"\x7f"]


def test_a_standstill_is_not_made_up_for_by_a_burst_of_heartbeats():
    master = Master()
    master.now_s = 10.3
    assert [f.id for f in master.node.tick(master.now_s)] == [0x705]
    beats_s = [now_s for now_s, f in master.wait(2.5) if f.id == 0x705]
    assert beats_s == [pytest.approx(11.3), pytest.approx(12.3)]


def test_nothing_is_obeyed_before_the_boot_up():
    node = CanopenNode(Rig(), Options(), IDENTITY)
    assert node.receive(CanFrame(0, b"\x01\x05"), 0.0) == []
    assert [frame.data for frame in node.tick(0.0)] == [b"\x00"]
    assert [f.data for f in node.tick(1.0)] == [b"\x7f"]


def test_what_happened_before_the_start_is_not_told_after_it():
    master = Master()
    master.say("605 2F 02 18 02 00")  # at the SYNC after an event
    master.rig.set(state="venting")
    master.wait(0.1)
    master.say("000 01 05")
    assert master.say("080") == []


def test_a_node_hears_its_own_identifiers_and_its_masters_heartbeat_alone(master):
    heard = {can_id for can_id in range(0x800) if master.node.hears(CanFrame(can_id))}
    own = {base + 5 for base in (0x080, 0x180, 0x200, 0x280, 0x380, 0x480, 0x580, 0x600, 0x700)}
    assert heard == own | {0x000, 0x080}
    master.say("605 23 16 10 01 F4 01 7F 00")
    assert master.node.hears(CanFrame(0x77F))
