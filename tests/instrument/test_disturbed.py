"""What a disturbed line, sensor or baseline may not do to the force: show a wrong one as if it were right."""

import math
import random

import pytest

from instrument.chain import Chain, ChainSettings
from instrument.cli.measured_scenario import measured
from instrument.lag import MOST_STEPS, SAMPLE_S, LagCompensator
from instrument.measurement import Quality
from sim.headless import Playback
from sim.scenario import Scenario
from tests.instrument.driving import Drive, Tube
from tests.instrument.test_chain import Feed

TUBE_S = 0.06


def followed(gaps, seconds=6.0):
    """Pressure of a balloon that is pressed to 1.5 kPa above 8, and what a lossy line makes of it."""
    lag, tube, gauss = LagCompensator(TUBE_S), Tube(8.0, 8.0), random.Random(4).gauss
    since_s = 0.0
    for n in range(round(seconds / SAMPLE_S)):
        tube.step(9.5 if n > 500 else 8.0)
        since_s += SAMPLE_S
        if gaps(n):
            continue
        yield n * SAMPLE_S, tube.balloon_kpa, lag.step(tube.sensor_kpa + gauss(0, 0.0103), since_s)
        since_s = 0.0


@pytest.mark.parametrize("every", range(1, 2 * MOST_STEPS))
def test_whatever_the_spacing_of_the_samples_the_compensation_stays_near_the_truth(every):
    """A stationary gain for 2 ms would be unstable from 14 ms on."""
    for t_s, truth_kpa, shown_kpa in followed(lambda n: n % every):
        near = 0.35 if t_s > 1.6 else 1.6  # while the hand presses, sparse samples only lag
        assert abs(shown_kpa - truth_kpa) < near, t_s


@pytest.mark.parametrize(("share", "lost"), [(0.1, 15), (0.05, 50), (0.02, 50), (0.3, 5)])
def test_gaps_at_random_never_throw_the_compensation_off(share, lost):
    draw, until = random.Random(9), [0]

    def gaps(n):
        if n >= until[0] and draw.random() < share:
            until[0] = n + draw.randint(1, lost)
        return n < until[0]

    for t_s, truth_kpa, shown_kpa in followed(gaps, 12.0):
        if t_s > 1.8:
            assert abs(shown_kpa - truth_kpa) < 0.3, t_s


@pytest.mark.parametrize("glitch_kpa", [5.0, -5.0, 1.0])
@pytest.mark.parametrize("lasts", [1, 2])
@pytest.mark.parametrize("pressed_kpa", [0.0, 1.5])
def test_a_disturbed_sample_or_two_is_no_force_and_no_contact(glitch_kpa, lasts, pressed_kpa):
    feed = Feed.locked()
    m = feed.press(8.0 + pressed_kpa, 2.0)
    before_n, count = m.force_n, feed.chain.tracker.count
    for _ in range(lasts):
        assert feed.jump(8.0 + pressed_kpa + glitch_kpa).force_n == pytest.approx(before_n, abs=0.05)
    for _ in range(300):
        assert feed.press(8.0 + pressed_kpa, 0.002).force_n == pytest.approx(before_n, abs=0.05)
    assert feed.chain.tracker.count == count


@pytest.mark.parametrize("dead", [1, 4])
def test_some_dead_samples_in_a_contact_do_not_make_it_a_free_balloon(dead):
    drive = Drive.holding()
    drive.push_kpa = 1.5
    drive.run(1.0)
    before_n = drive.see().force_n
    drive.adc_sum = 16 * 1023
    for _ in range(dead):
        drive.feed()
    drive.adc_sum = None
    drive.run(1.0)
    assert drive.inflates
    assert drive.see().force_n == pytest.approx(before_n, abs=0.02)
    assert "in_contact" in drive.see().status


@pytest.mark.parametrize("setpoint_kpa", [8.0, 11.8])
def test_the_force_alarm_comes_in_and_out_of_the_validated_range(setpoint_kpa):
    drive = Drive.holding(request={"setpoint_requested_kpa": setpoint_kpa})
    drive.must({"force_limit_n": 1.0})
    drive.push_kpa = 2.0
    drive.run(1.0)
    assert "force_limit" in drive.see().status


def test_the_force_alarm_does_not_ask_the_compensated_pressure():
    drive = Drive.holding()
    drive.must({"force_limit_n": 1.0})
    drive.push_kpa = 2.0
    drive.run(1.0)
    drive.instrument.chain._lag._pressure_kpa = 1e6  # as wrong as it can be
    drive.feed()
    assert "force_limit" in drive.see().status


def held(fault, free_s, **arguments):
    """Forces shown while 1.5 N is held for a minute and a half, some time after a fault was put in."""
    waiting = {"kind": "press", "force_n": 0.0, "hold_s": free_s, "pause_s": 0.0}
    scenario = Scenario(
        doc="a long hold on a drifting baseline",
        fault=[{"name": fault, "at_s": 6.0, **arguments}],
        phase=[
            {"setpoint_kpa": [8.0], "contact": [waiting, {"kind": "hold", "force_n": 1.5, "hold_s": 90.0}]}
        ],
    )
    for m, truth in measured(Playback(scenario), ChainSettings()):
        if truth.force_n == 1.5:
            yield m, truth


@pytest.mark.parametrize(
    ("fault", "arguments", "free_s", "most_n"),
    [
        ("balloon_warming", {}, 10.0, 0.05),
        ("leak", {"kpa_per_s": 0.01}, 10.0, 0.15),
        ("leak", {"kpa_per_s": 0.02}, 4.0, 0.5),
    ],
)
def test_a_long_press_on_a_drifting_baseline_stays_a_force(fault, arguments, free_s, most_n):
    seen = list(held(fault, free_s, **arguments))
    assert len(seen) == 45_000
    for m, truth in seen[500:]:
        assert m.force_n == pytest.approx(1.5, abs=most_n), truth.t_s


def test_where_drift_may_have_hidden_a_contact_there_is_no_force_until_the_next_lock():
    chain = Chain(ChainSettings())
    chain.tracker.lost = True
    chain.tracker.initial_kpa = 8.0
    feed = Feed()
    feed.chain = chain
    chain.zero.zero_kpa = 0.2
    feed.tube = Tube(8.0, 8.0)
    m = feed.press(8.0, 0.1)
    assert m.quality == Quality.NO_BASELINE
    assert math.isnan(m.force_n)
    feed.kpa(0.2)  # vented
    assert feed.press(8.0, 0.5).force_n == 0.0
