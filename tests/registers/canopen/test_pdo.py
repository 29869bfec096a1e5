"""TPDOs in time: the same as in raw mode, then as a master has set them."""

import itertools
import math

import pytest

from registers.can.node import CanNode
from registers.can.options import Options, bus_load
from registers.can.wire import CanFrame
from registers.canopen import parameters
from tests.registers.can.rig import Rig
from tests.registers.canopen.cases import OPERATIONAL
from tests.registers.canopen.talking import Master

TPDO_IDS = (0x185, 0x285, 0x385, 0x485)
STALE = frozenset({"stale", "stale_or_lost"})
#: (time, what happens) to rigs that a raw node and a CANopen node serve.
EVENTS = [
    (0.203, {"state": "venting"}),
    (0.207, {"refusal": "lease"}),
    (0.341, {"status": frozenset({"holding", "in_contact", "force_valid"}), "contact_counter": 1}),
    (0.522, {"setpoint_kpa": 9.0}),
    (0.617, {"status": frozenset({"holding", "force_valid", "force_limit"})}),
    (0.700, {"status": STALE, "force_n": math.nan}),
    (1.000, {"status": frozenset({"holding", "force_valid"}), "force_n": 2.0}),
]


def course(node, rig, seconds=1.5, start=lambda node: None):
    """TPDOs of a node with their times; samples come but while they are stale."""
    events, sent = list(EVENTS), []
    node.tick(0.0)
    start(node)
    for step in range(round(seconds / 0.002)):
        now_s = round(step * 0.002, 6)
        while events and events[0][0] <= now_s:
            rig.set(**events.pop(0)[1])
        frames = [] if "stale" in rig.now.status else node.on_sample(now_s)
        frames += node.tick(now_s) if step % 5 == 0 else []
        sent += [(now_s, frame) for frame in frames if frame.id in TPDO_IDS]
    return sent


@pytest.mark.parametrize("rate_hz", [1, 100, 333, 500])
def test_out_of_the_box_the_process_data_are_those_of_raw_mode(rate_hz):
    raw_rig, master = Rig(setpoint_kpa=8.0), Master(rig=Rig(setpoint_kpa=8.0), force_rate_hz=rate_hz)
    raw = course(CanNode(raw_rig, Options(force_rate_hz=rate_hz)), raw_rig)
    canopen = course(master.node, master.rig, start=lambda node: node.receive(CanFrame(0, b"\x01\x05"), 0.0))
    assert [sent for sent in canopen if sent[1].id == 0x185] == [sent for sent in raw if sent[1].id == 0x185]
    for can_id in TPDO_IDS[1:3]:
        before = [frame.data for _, frame in raw if frame.id == can_id]
        after = [frame.data for _, frame in canopen if frame.id == can_id]
        assert abs(len(before) - len(after)) <= 1
        assert {data[:7] for data in before} == {data[:7] for data in after}


def test_a_change_leaves_at_the_sample_that_shows_it():
    master = Master(OPERATIONAL)
    sent = course(master.node, master.rig)
    status = [now_s for now_s, frame in sent if frame.id == 0x385]
    force = [(now_s, frame.data) for now_s, frame in sent if frame.id == 0x185]
    assert 0.342 in status
    assert 0.21 in status  # 0.204 was within the inhibit time
    assert any(now_s == pytest.approx(0.618) and data[6] & 0x10 for now_s, data in force)


def times(master, seconds, can_id, **how):
    return [now_s for now_s, frame in master.wait(seconds, **how) if frame.id == can_id]


def test_an_event_timer_repeats_what_nothing_changes():
    master = Master()
    master.say("605 2B 01 18 05 32")  # 50 ms
    master.say("000 01 05")
    assert len(times(master, 1.0, 0x285)) == pytest.approx(20, abs=1)


def test_no_event_timer_no_repetition():
    master = Master()
    master.say("605 2B 01 18 05 00 00")
    master.say("000 01 05")
    assert len(times(master, 1.0, 0x285)) <= 1
    master.rig.set(setpoint_kpa=9.0)
    assert len(times(master, 1.0, 0x285)) == 1


def inhibit_force(master, time):
    """It is changed while the TPDO is off."""
    for said in ("605 23 00 18 01 85 01 00 C0", f"605 2B 00 18 03 {time}", "605 23 00 18 01 85 01 00 40"):
        (answer,) = master.say(said)
        assert answer.data[0] == 0x60


def test_the_inhibit_time_keeps_force_frames_apart():
    master = Master(OPERATIONAL, force_rate_hz=500)
    assert len(times(master, 1.0, 0x185, samples=True)) == pytest.approx(500, abs=2)
    inhibit_force(master, "F4 01")  # 50 ms
    sent = times(master, 1.0, 0x185, samples=True)
    assert len(sent) == pytest.approx(20, abs=1)
    assert min(b - a for a, b in itertools.pairwise(sent)) >= 0.0499


def test_what_is_sent_at_sync_is_not_sent_by_time():
    master = Master()
    master.say("605 2F 00 18 02 01")
    master.say("000 01 05")
    assert times(master, 1.0, 0x185, samples=True) == []
    first, second = (master.say("080")[0].data for _ in range(2))
    assert (second[7] - first[7]) % 256 == 1


def test_at_the_sync_after_an_event_only():
    master = Master()
    master.say("605 2F 02 18 02 00")
    master.say("000 01 05")
    master.wait(0.5)
    assert master.say("080") == []
    master.rig.set(state="venting")
    master.wait(0.02)
    assert [frame.id for frame in master.say("080")] == [0x385]
    assert master.say("080") == []


def test_a_tpdo_that_is_off_is_silent_and_comes_back():
    master = Master(OPERATIONAL)
    master.say("605 23 00 18 01 85 01 00 C0")
    assert times(master, 0.5, 0x185, samples=True) == []
    master.say("605 23 00 18 01 85 01 00 40")
    assert times(master, 0.5, 0x185, samples=True)


def test_a_master_cannot_load_the_bus_beyond_60_percent():
    master = Master(bit_rate=125_000)
    refused = (0x0609_0030).to_bytes(4, "little")
    (answer,) = master.say("605 2B 00 18 05 02")  # 2 ms: 500 a second more
    assert answer.data[4:] == refused
    assert master.say("605 40 00 18 05")[0].data[4:6] == b"\0\0"
    (answer,) = master.say("605 2B 17 10 00 01")  # a heartbeat each millisecond
    assert answer.data[4:] == refused
    (answer,) = master.say("605 2B 00 18 05 0A")
    assert answer.data[0] == 0x60


@pytest.mark.parametrize("rate_hz", [1, 100, 500])
def test_out_of_the_box_it_loads_the_bus_as_raw_mode_does(rate_hz):
    options = Options(force_rate_hz=rate_hz)
    assert parameters.bus_load(parameters.Parameters(options), options) == pytest.approx(bus_load(options))


def test_an_inhibit_time_makes_room_for_a_faster_timer():
    master = Master(bit_rate=125_000)
    inhibit_force(master, "64")  # 10 ms
    (answer,) = master.say("605 2B 00 18 05 02")
    assert answer.data[0] == 0x60


def test_the_counter_goes_up_by_one_with_each_force_frame():
    master = Master(OPERATIONAL)
    counters = [f.data[7] for _, f in master.wait(3.0, samples=True) if f.id == 0x185]
    assert len(counters) > 256
    assert all((b - a) % 256 == 1 for a, b in itertools.pairwise(counters))
