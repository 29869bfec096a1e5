"""Tests of the times at which TPDOs are sent: as in raw mode by default, or as a master configures them."""

import itertools
import math

import pytest

from pneuforce.registers.can.frames import IDENTITY
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions, bus_load
from pneuforce.registers.can.wire import CanFrame, worst_case_bits
from pneuforce.registers.canopen import parameters
from tests.registers.can.fake_source import FakeSource
from tests.registers.canopen.cases import OPERATIONAL
from tests.registers.canopen.fake_master import FakeMaster

TPDO_IDS = (0x185, 0x285, 0x385, 0x485)
STALE = frozenset({"stale", "stale_or_lost"})
#: Pairs of a time [s] and a change of the source at this time.
EVENTS = [
    (0.203, {"state": "venting"}),
    (0.207, {"reject_reason": "lease"}),
    (0.341, {"status": frozenset({"holding", "in_contact", "force_valid"}), "contact_counter": 1}),
    (0.522, {"setpoint_kpa": 9.0}),
    (0.617, {"status": frozenset({"holding", "force_valid", "force_high_alarm"})}),
    (0.700, {"status": STALE, "force_n": math.nan}),
    (1.000, {"status": frozenset({"holding", "force_valid"}), "force_n": 2.0}),
]


def record_tpdos(node, source, seconds=1.5, start=lambda node: None):
    """Return the TPDOs of a node with their times. The node receives no samples while the status is stale."""
    events, sent = list(EVENTS), []
    node.tick(0.0)
    start(node)
    for step in range(round(seconds / 0.002)):
        now_s = round(step * 0.002, 6)
        while events and events[0][0] <= now_s:
            source.set(**events.pop(0)[1])
        frames = [] if "stale" in source.now.status else node.on_sample(now_s)
        frames += node.tick(now_s) if step % 5 == 0 else []
        sent += [(now_s, frame) for frame in frames if frame.id in TPDO_IDS]
    return sent


@pytest.mark.parametrize("rate_hz", [1, 100, 333, 500])
def test_by_default_the_process_data_are_those_of_raw_mode(rate_hz):
    raw_source = FakeSource(setpoint_kpa=8.0)
    master = FakeMaster(source=FakeSource(setpoint_kpa=8.0), force_rate_hz=rate_hz)
    raw = record_tpdos(CanNode(raw_source, CanOptions(force_rate_hz=rate_hz)), raw_source)
    canopen = record_tpdos(
        master.node, master.source, start=lambda node: node.receive(CanFrame(0, b"\x01\x05"), 0.0)
    )
    assert [sent for sent in canopen if sent[1].id == 0x185] == [sent for sent in raw if sent[1].id == 0x185]
    for can_id in TPDO_IDS[1:3]:
        raw_data = [frame.data for _, frame in raw if frame.id == can_id]
        canopen_data = [frame.data for _, frame in canopen if frame.id == can_id]
        assert abs(len(raw_data) - len(canopen_data)) <= 1
        assert {data[:7] for data in raw_data} == {data[:7] for data in canopen_data}


def test_a_change_is_sent_with_its_first_sample():
    master = FakeMaster(OPERATIONAL)
    sent = record_tpdos(master.node, master.source)
    status = [now_s for now_s, frame in sent if frame.id == 0x385]
    force = [(now_s, frame.data) for now_s, frame in sent if frame.id == 0x185]
    assert 0.342 in status
    assert 0.21 in status  # at 0.204 s, the inhibit time has not passed
    assert any(now_s == pytest.approx(0.618) and data[6] & 0x10 for now_s, data in force)


def times(master, seconds, can_id, **how):
    return [now_s for now_s, frame in master.wait(seconds, **how) if frame.id == can_id]


def test_the_event_timer_sends_a_tpdo_without_events():
    master = FakeMaster()
    master.send("605 2B 01 18 05 32")  # event timer 50 ms
    master.send("000 01 05")
    assert len(times(master, 1.0, 0x285)) == pytest.approx(20, abs=1)


def test_without_an_event_timer_a_tpdo_is_sent_only_at_events():
    master = FakeMaster()
    master.send("605 2B 01 18 05 00 00")
    master.send("000 01 05")
    assert len(times(master, 1.0, 0x285)) <= 1
    master.source.set(setpoint_kpa=9.0)
    assert len(times(master, 1.0, 0x285)) == 1


def inhibit_force(master, inhibit):
    """Change the inhibit time of the Force TPDO, which must be disabled for the change."""
    for step in ("605 23 00 18 01 85 01 00 C0", f"605 2B 00 18 03 {inhibit}", "605 23 00 18 01 85 01 00 40"):
        (answer,) = master.send(step)
        assert answer.data[0] == 0x60


def test_the_inhibit_time_is_the_shortest_time_between_force_frames():
    master = FakeMaster(OPERATIONAL, force_rate_hz=500)
    assert len(times(master, 1.0, 0x185, samples=True)) == pytest.approx(500, abs=2)
    inhibit_force(master, "F4 01")  # inhibit time 50 ms
    sent = times(master, 1.0, 0x185, samples=True)
    assert len(sent) == pytest.approx(20, abs=1)
    assert min(b - a for a, b in itertools.pairwise(sent)) >= 0.0499


def test_a_synchronous_tpdo_is_not_sent_by_time():
    master = FakeMaster()
    master.send("605 2F 00 18 02 01")
    master.send("000 01 05")
    assert times(master, 1.0, 0x185, samples=True) == []
    first, second = (master.send("080")[0].data for _ in range(2))
    assert (second[7] - first[7]) % 256 == 1


class SamplingSource(FakeSource):
    """Source with a new sample at each read. The force [mN] is the number of the sample."""

    def snapshot(self, peer, now_s):
        number = self.now.sample_counter + 1
        self.set(sample_counter=number, force_n=number / 1000)
        return self.now


def test_all_tpdos_of_a_sync_contain_the_sample_at_this_sync():
    master = FakeMaster(source=SamplingSource())
    for step in ("605 2F 00 18 02 01", "605 2F 02 18 02 01", "000 01 05"):
        master.send(step)
    sampled = master.source.now.sample_counter
    force, status = (frame.data for frame in master.send("080"))
    assert (force[0], status[7]) == (sampled + 1, sampled + 1)


def test_transmission_type_0_is_sent_only_at_the_sync_after_an_event():
    master = FakeMaster()
    master.send("605 2F 02 18 02 00")
    master.send("000 01 05")
    master.wait(0.5)
    assert master.send("080") == []
    master.source.set(state="venting")
    master.wait(0.02)
    assert [frame.id for frame in master.send("080")] == [0x385]
    assert master.send("080") == []


def test_a_tpdo_can_be_disabled_and_enabled():
    master = FakeMaster(OPERATIONAL)
    master.send("605 23 00 18 01 85 01 00 C0")
    assert times(master, 0.5, 0x185, samples=True) == []
    master.send("605 23 00 18 01 85 01 00 40")
    assert times(master, 0.5, 0x185, samples=True)


def test_a_master_cannot_configure_more_than_60_percent_bus_load():
    master = FakeMaster(bit_rate=125_000)
    rejected = (0x0609_0030).to_bytes(4, "little")
    (answer,) = master.send("605 2B 00 18 05 02")  # an event timer of 2 ms adds 500 frames per second
    assert answer.data[4:] == rejected
    assert master.send("605 40 00 18 05")[0].data[4:6] == b"\0\0"
    (answer,) = master.send("605 2B 17 10 00 01")  # a heartbeat each millisecond
    assert answer.data[4:] == rejected
    (answer,) = master.send("605 2B 00 18 05 0A")
    assert answer.data[0] == 0x60


@pytest.mark.parametrize("rate_hz", [1, 100, 500])
def test_by_default_the_bus_load_is_that_of_raw_mode(rate_hz):
    options = CanOptions(force_rate_hz=rate_hz)
    only_in_raw_mode = worst_case_bits(IDENTITY.length) * IDENTITY.max_rate_hz / options.bit_rate
    load = parameters.bus_load(parameters.Parameters(options), options)
    assert load == pytest.approx(bus_load(options) - only_in_raw_mode)


def test_an_inhibit_time_allows_a_faster_event_timer():
    master = FakeMaster(bit_rate=125_000)
    inhibit_force(master, "64")  # inhibit time 10 ms
    (answer,) = master.send("605 2B 00 18 05 02")
    assert answer.data[0] == 0x60


def test_the_counter_increases_by_one_with_each_force_frame():
    master = FakeMaster(OPERATIONAL)
    counters = [f.data[7] for _, f in master.wait(3.0, samples=True) if f.id == 0x185]
    assert len(counters) > 256
    assert all((b - a) % 256 == 1 for a, b in itertools.pairwise(counters))
