"""When frames leave: the node fed with samples and time, no bus in sight."""

import itertools
import math
from collections import Counter

import pytest

from registers.can.frames import EMERGENCY, FORCE, STATUS_FRAME, decode, read
from registers.can.node import CanNode
from registers.can.options import ALARMS_PER_S, Options
from tests.registers.can.rig import Rig

SAMPLE_S = 0.002
STALE = frozenset({"stale", "stale_or_lost"})


def run(node, seconds, *, samples=True, start_s=0.0):
    """(time, name, values) of all frames; 500 samples and 100 ticks per second."""
    sent = []
    for step in range(round(seconds / SAMPLE_S)):
        now_s = start_s + step * SAMPLE_S
        frames = node.on_sample(now_s) if samples else []
        frames += node.tick(now_s) if step % 5 == 0 else []
        for frame in frames:
            declared, values = read(frame, node.options.node_id)
            sent.append((now_s, declared.name, values))
    return sent


def of(sent, name):
    return [(now_s, values) for now_s, frame, values in sent if frame == name]


@pytest.fixture
def rig():
    return Rig(force_n=1.0, setpoint_kpa=8.0)


@pytest.mark.parametrize("rate_hz", [1, 7, 50, 100, 333, 500])
def test_force_leaves_at_its_rate_counted_in_samples(rig, rate_hz):
    sent = of(run(CanNode(rig, Options(force_rate_hz=rate_hz)), 2.0), "Force")
    assert abs(len(sent) - 2 * rate_hz) <= 1
    gaps = [round((b - a) / SAMPLE_S) for (a, _), (b, _) in itertools.pairwise(sent)]
    assert max(gaps) - min(gaps) <= 1


def test_the_first_sample_is_sent_and_the_counter_goes_up_by_one(rig):
    sent = of(run(CanNode(rig, Options(force_rate_hz=500)), 1.2), "Force")
    assert sent[0][0] == 0.0
    counters = [values["counter"] for _, values in sent]
    assert all((b - a) % 256 == 1 for a, b in itertools.pairwise(counters))


def test_the_cyclic_frames_keep_their_rate(rig):
    counts = Counter(name for _, name, _ in run(CanNode(rig, Options()), 10.0))
    assert counts["State"] == pytest.approx(100, abs=1)
    assert counts["Status"] == pytest.approx(100, abs=1)
    assert counts["Heartbeat"] == 10


@pytest.mark.parametrize("status", [frozenset({"holding"}), STALE])
def test_the_heartbeat_begins_with_a_boot_up_and_beats_without_samples(rig, status):
    rig.set(status=status)
    beats = of(run(CanNode(rig, Options()), 3.5, samples=False), "Heartbeat")
    assert [values["node_state"] for _, values in beats] == ["boot_up"] + 3 * ["operational"]


def test_force_not_available_leaves_at_once_when_samples_stop_then_at_10_hz(rig):
    node = CanNode(rig, Options())
    run(node, 1.0)
    rig.set(force_n=math.nan, status=STALE)
    sent = of(run(node, 1.0, samples=False, start_s=1.1), "Force")
    assert sent[0][0] == 1.1
    assert len(sent) == 10
    assert all(math.isnan(values["force"]) for _, values in sent)
    assert all("force_valid" not in values["condensed_status"] for _, values in sent)


def test_the_first_sample_after_a_silence_is_sent_at_once(rig):
    node = CanNode(rig, Options(force_rate_hz=1))
    run(node, 0.1)
    rig.set(status=STALE)
    run(node, 1.0, samples=False, start_s=1.0)
    rig.set(status=frozenset({"force_valid"}))
    assert of(run(node, 0.01, start_s=2.0), "Force")[0][0] == 2.0


CHANGES = [
    ("Status", {"status": frozenset({"holding", "force_valid", "force_limit"})}),
    ("Status", {"state": "venting"}),
    ("Status", {"refusal": "lease"}),
    ("State", {"setpoint_kpa": 9.0}),
    ("State", {"setpoint_kpa": math.nan}),
]


@pytest.mark.parametrize(("name", "change"), CHANGES)
def test_a_change_is_told_with_the_next_sample_not_with_the_next_cycle(rig, name, change):
    node = CanNode(rig, Options())
    run(node, 0.33)
    rig.set(**change)
    assert len(of(run(node, SAMPLE_S, start_s=0.33), name)) == 1
    assert not of(run(node, 0.05, start_s=0.332), name)


def test_a_finished_contact_is_told_at_once_and_a_begun_one_is_not_in_state(rig):
    node = CanNode(rig, Options())
    run(node, 0.33)
    rig.set(status=rig.now.status | {"in_contact"}, contact_counter=1)
    assert not of(run(node, 0.01, start_s=0.33), "State")
    rig.set(status=rig.now.status - {"in_contact"}, peak_force_n=2.0)
    ((_, values),) = of(run(node, 0.01, start_s=0.34), "State")
    assert values["peak_force"] == 2.0


def test_a_contact_that_ends_as_the_next_begins_is_told_too(rig):
    rig.set(status=rig.now.status | {"in_contact"}, contact_counter=1)
    node = CanNode(rig, Options())
    run(node, 0.33)
    rig.set(contact_counter=2, peak_force_n=2.0)
    assert len(of(run(node, 0.01, start_s=0.33), "State")) == 1


def test_a_setpoint_that_stays_not_available_is_no_change(rig):
    rig.set(setpoint_kpa=math.nan)
    assert len(of(run(CanNode(rig, Options()), 1.0), "State")) == 10


def test_a_flickering_status_is_told_at_most_every_10_ms(rig):
    node = CanNode(rig, Options())
    sent_s = []
    for step in range(500):
        rig.set(status=frozenset({"holding"} if step % 2 else {"vented"}))
        now_s = step * SAMPLE_S
        sent_s += [now_s for frame in node.on_sample(now_s) if frame.id == STATUS_FRAME.base_id + 5]
    gaps = [b - a for a, b in itertools.pairwise(sent_s)]
    assert len(sent_s) > 80
    assert min(gaps) >= 0.01 - 1e-9


def emergencies(frames):
    return [decode(EMERGENCY, frame.data) for frame in frames if frame.id == 0x085]


FAULTS = [  # latched faults, then error codes told
    ((4,), [0xFF04]),
    ((4, 13), [0xFF0D]),
    ((4,), [0x0000]),
    ((32,), [0x0000, 0xFF20]),
    ((32, 34, 9), [0xFF22, 0xFF09]),
    ((), [0x0000]),
]


def test_each_faults_coming_and_going_is_told_once_with_its_own_code(rig):
    node = CanNode(rig, Options())
    assert not emergencies(node.tick(0.0))
    for step, (faults, codes) in enumerate(FAULTS, start=1):
        rig.set(faults=faults, active_faults=len(faults))
        told = emergencies(node.on_sample(step * 0.1) + node.tick(step * 0.1))
        assert [frame["error_code"] for frame in told] == codes
        assert {frame["error_register"] for frame in told} == {0x81 if faults else 0}
        assert {frame["active_faults"] for frame in told} == {len(faults)}


def test_another_node_id_moves_every_identifier(rig):
    node = CanNode(rig, Options(node_id=127))
    frames = node.on_sample(0.0) + node.tick(0.0)
    assert {frame.id & 0x7F for frame in frames} == {127}
    assert FORCE.base_id + 127 in {frame.id for frame in frames}


ALARM = frozenset({"holding", "force_valid", "force_limit"})


@pytest.mark.parametrize("rate_hz", [1, 100, 500])
def test_the_alarm_leaves_with_the_sample_that_raises_it_whatever_the_rate(rig, rate_hz):
    node = CanNode(rig, Options(force_rate_hz=rate_hz))
    run(node, 0.332)
    rig.set(status=ALARM)
    told = [read(frame, 5) for frame in node.on_sample(0.332)]
    assert [declared.name for declared, _ in told] == ["Force", "Status"]
    assert "force_limit" in told[0][1]["condensed_status"]
    assert "force_limit" in told[1][1]["status"]


def test_an_alarm_right_behind_a_status_does_not_wait_for_the_next_one(rig):
    node = CanNode(rig, Options(force_rate_hz=1))
    run(node, 0.33)
    rig.set(state="settling")
    assert [frame.id for frame in node.on_sample(0.33)] == [0x385]
    rig.set(status=ALARM)
    assert [frame.id for frame in node.on_sample(0.332)] == [0x185]


def test_an_early_alarm_is_one_frame_more_and_moves_no_other(rig):
    calm = of(run(CanNode(rig, Options()), 1.0), "Force")
    node = CanNode(rig, Options())
    sent = run(node, 0.502)
    rig.set(status=ALARM)
    sent += run(node, 0.498, start_s=0.502)
    times_s, calm_s = ({round(now_s, 3) for now_s, _ in frames} for frames in (of(sent, "Force"), calm))
    assert (times_s - calm_s, calm_s - times_s) == ({0.502}, set())


def test_a_force_that_flickers_about_its_limit_stays_within_the_load_that_is_checked(rig):
    for period in range(2, 12):
        node, sent = CanNode(rig, Options()), 0
        for step in range(5000):
            rig.set(status=ALARM if step % period else ALARM - {"force_limit"})
            sent += sum(frame.id == 0x185 for frame in node.on_sample(step * SAMPLE_S))
        assert sent <= 10 * (100 + ALARMS_PER_S)
