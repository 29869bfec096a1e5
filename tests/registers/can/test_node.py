"""Tests of the frames that a node sends: times and contents. The node runs without a bus."""

import itertools
import math
from collections import Counter

import pytest

from pneuforce.registers.can.frames import EMERGENCY, FORCE, STATUS_FRAME, decode, decode_frame
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import MAX_ALARM_FRAMES_PER_S, CanOptions
from tests.registers.can.fake_source import FakeSource

SAMPLE_S = 0.002
STALE = frozenset({"stale", "stale_or_lost"})


def run(node, seconds, *, samples=True, start_s=0.0):
    """Run a node with 500 samples and 100 ticks per second. Return (time, name, values) of each frame."""
    sent = []
    for step in range(round(seconds / SAMPLE_S)):
        now_s = start_s + step * SAMPLE_S
        frames = node.on_sample(now_s) if samples else []
        frames += node.tick(now_s) if step % 5 == 0 else []
        for frame in frames:
            declared, values = decode_frame(frame, node.options.node_id)
            sent.append((now_s, declared.name, values))
    return sent


def of(sent, name):
    return [(now_s, values) for now_s, frame, values in sent if frame == name]


@pytest.fixture
def source():
    return FakeSource(force_n=1.0, setpoint_kpa=8.0)


@pytest.mark.parametrize("rate_hz", [1, 7, 50, 100, 333, 500])
def test_force_is_sent_at_its_rate_counted_in_samples(source, rate_hz):
    sent = of(run(CanNode(source, CanOptions(force_rate_hz=rate_hz)), 2.0), "Force")
    assert abs(len(sent) - 2 * rate_hz) <= 1
    gaps = [round((b - a) / SAMPLE_S) for (a, _), (b, _) in itertools.pairwise(sent)]
    assert max(gaps) - min(gaps) <= 1


def test_the_first_sample_is_sent_and_the_counter_increases_by_one(source):
    sent = of(run(CanNode(source, CanOptions(force_rate_hz=500)), 1.2), "Force")
    assert sent[0][0] == 0.0
    counters = [values["counter"] for _, values in sent]
    assert all((b - a) % 256 == 1 for a, b in itertools.pairwise(counters))


def test_the_cyclic_frames_have_their_rate(source):
    counts = Counter(name for _, name, _ in run(CanNode(source, CanOptions()), 10.0))
    assert counts["State"] == pytest.approx(100, abs=1)
    assert counts["Status"] == pytest.approx(100, abs=1)
    assert counts["Heartbeat"] == 10
    assert counts["Identity"] == 10


def test_the_identity_contains_the_map_hash_also_without_samples(source):
    source.set(status=STALE, serial_number=77, map_hash=0x12345678)
    sent = of(run(CanNode(source, CanOptions()), 0.5, samples=False), "Identity")
    assert sent == [(0.0, {"map_hash": 0x12345678, "serial_number": 77})]


@pytest.mark.parametrize("status", [frozenset({"holding"}), STALE])
def test_the_heartbeat_starts_with_a_boot_up_and_is_sent_without_samples(source, status):
    source.set(status=status)
    beats = of(run(CanNode(source, CanOptions()), 3.5, samples=False), "Heartbeat")
    assert [values["node_state"] for _, values in beats] == ["boot_up"] + 3 * ["operational"]


def test_the_boot_up_is_the_first_frame_also_if_a_sample_arrives_first(source):
    names = [name for _, name, _ in run(CanNode(source, CanOptions()), 3.5)]
    assert (names[0], names.count("Heartbeat")) == ("Heartbeat", 4)


def test_force_not_available_is_sent_at_once_when_samples_stop_then_at_10_hz(source):
    node = CanNode(source, CanOptions())
    run(node, 1.0)
    source.set(force_n=math.nan, status=STALE)
    sent = of(run(node, 1.0, samples=False, start_s=1.1), "Force")
    assert sent[0][0] == 1.1
    assert len(sent) == 10
    assert all(math.isnan(values["force"]) for _, values in sent)
    assert all("force_valid" not in values["condensed_status"] for _, values in sent)


def test_the_first_sample_after_a_gap_is_sent_at_once(source):
    node = CanNode(source, CanOptions(force_rate_hz=1))
    run(node, 0.1)
    source.set(status=STALE)
    run(node, 1.0, samples=False, start_s=1.0)
    source.set(status=frozenset({"force_valid"}))
    assert of(run(node, 0.01, start_s=2.0), "Force")[0][0] == 2.0


CHANGES = [
    ("Status", {"status": frozenset({"holding", "force_valid", "force_high_alarm"})}),
    ("Status", {"state": "venting"}),
    ("Status", {"reject_reason": "lease"}),
    ("State", {"setpoint_kpa": 9.0}),
    ("State", {"setpoint_kpa": math.nan}),
]


@pytest.mark.parametrize(("name", "change"), CHANGES)
def test_a_change_is_sent_with_the_next_sample_not_with_the_next_cycle(source, name, change):
    node = CanNode(source, CanOptions())
    run(node, 0.33)
    source.set(**change)
    assert len(of(run(node, SAMPLE_S, start_s=0.33), name)) == 1
    assert not of(run(node, 0.05, start_s=0.332), name)


def test_a_complete_peak_triggers_state_and_the_start_of_a_contact_does_not(source):
    node = CanNode(source, CanOptions())
    run(node, 0.33)
    source.set(status=source.now.status | {"in_contact"}, contact_counter=1)
    assert not of(run(node, 0.01, start_s=0.33), "State")
    source.set(peak_counter=1, peak_force_n=2.0)
    ((_, values),) = of(run(node, 0.01, start_s=0.34), "State")
    assert values["peak_force"] == 2.0


def test_a_setpoint_that_stays_not_available_does_not_trigger_state(source):
    source.set(setpoint_kpa=math.nan)
    assert len(of(run(CanNode(source, CanOptions()), 1.0), "State")) == 10


def test_a_status_that_changes_with_each_sample_is_sent_at_most_every_10_ms(source):
    node = CanNode(source, CanOptions())
    sent_s = []
    for step in range(500):
        source.set(status=frozenset({"holding"} if step % 2 else {"vented"}))
        now_s = step * SAMPLE_S
        sent_s += [now_s for frame in node.on_sample(now_s) if frame.id == STATUS_FRAME.base_id + 5]
    gaps = [b - a for a, b in itertools.pairwise(sent_s)]
    assert len(sent_s) > 80
    assert min(gaps) >= 0.01 - 1e-9


def emergencies(frames):
    return [decode(EMERGENCY, frame.data) for frame in frames if frame.id == 0x085]


FAULTS = [  # each row: the latched faults, and the error codes that the node then sends
    ((4,), [0xFF04]),
    ((4, 13), [0xFF0D]),
    ((4,), [0x0000]),
    ((32,), [0x0000, 0xFF20]),
    ((32, 34, 9), [0xFF22, 0xFF09]),
    ((), [0x0000]),
]


def test_each_new_and_each_cleared_fault_is_sent_once(source):
    node = CanNode(source, CanOptions())
    assert not emergencies(node.tick(0.0))
    for step, (faults, codes) in enumerate(FAULTS, start=1):
        source.set(faults=faults, active_fault_count=len(faults))
        sent = emergencies(node.on_sample(step * 0.1) + node.tick(step * 0.1))
        assert [frame["error_code"] for frame in sent] == codes
        assert {frame["error_register"] for frame in sent} == {0x81 if faults else 0}
        assert {frame["active_fault_count"] for frame in sent} == {len(faults)}


def test_the_node_id_is_part_of_every_identifier(source):
    node = CanNode(source, CanOptions(node_id=127))
    frames = node.on_sample(0.0) + node.tick(0.0)
    assert {frame.id & 0x7F for frame in frames} == {127}
    assert FORCE.base_id + 127 in {frame.id for frame in frames}


ALARM = frozenset({"holding", "force_valid", "force_high_alarm"})


@pytest.mark.parametrize("rate_hz", [1, 100, 500])
def test_the_alarm_is_sent_with_the_sample_that_raises_it_at_any_rate(source, rate_hz):
    node = CanNode(source, CanOptions(force_rate_hz=rate_hz))
    run(node, 0.332)
    source.set(status=ALARM)
    sent = [decode_frame(frame, 5) for frame in node.on_sample(0.332)]
    assert [declared.name for declared, _ in sent] == ["Force", "Status"]
    assert "force_high_alarm" in sent[0][1]["condensed_status"]
    assert "force_high_alarm" in sent[1][1]["status"]


def test_an_alarm_right_after_a_status_does_not_wait_for_the_next_status(source):
    node = CanNode(source, CanOptions(force_rate_hz=1))
    run(node, 0.33)
    source.set(state="settling")
    assert [frame.id for frame in node.on_sample(0.33)] == [0x385]
    source.set(status=ALARM)
    assert [frame.id for frame in node.on_sample(0.332)] == [0x185]


def test_an_early_alarm_adds_one_frame_and_moves_no_other(source):
    without_alarm = of(run(CanNode(source, CanOptions()), 1.0), "Force")
    node = CanNode(source, CanOptions())
    sent = run(node, 0.502)
    source.set(status=ALARM)
    sent += run(node, 0.498, start_s=0.502)
    times_s, without_alarm_s = (
        {round(now_s, 3) for now_s, _ in frames} for frames in (of(sent, "Force"), without_alarm)
    )
    assert (times_s - without_alarm_s, without_alarm_s - times_s) == ({0.502}, set())


def test_a_force_that_oscillates_about_its_limit_stays_within_the_checked_load(source):
    for period in range(2, 12):
        node, sent = CanNode(source, CanOptions()), 0
        for step in range(5000):
            source.set(status=ALARM if step % period else ALARM - {"force_high_alarm"})
            sent += sum(frame.id == 0x185 for frame in node.on_sample(step * SAMPLE_S))
        assert sent <= 10 * (100 + MAX_ALARM_FRAMES_PER_S)
