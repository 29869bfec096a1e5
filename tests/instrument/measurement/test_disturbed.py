"""Tests of a disturbed line, sensor or baseline: a wrong force is never marked as good."""

import math
import random

import pytest

from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.lag import MAX_BRIDGED_SAMPLES, SAMPLE_S, LagCompensator
from pneuforce.instrument.measurement.measurement import Quality
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import Scenario
from tests.instrument.instrument_harness import InstrumentHarness, Tube
from tests.instrument.measurement.test_chain import ChainHarness

TUBE_S = 0.06


def compensated(is_lost, seconds=6.0):
    """Simulate a press from 8 to 9.5 kPa. Yield time, true pressure and compensated pressure of each sample.

    Sample n is lost if `is_lost(n)` is true.
    """
    lag, tube, gauss = LagCompensator(TUBE_S), Tube(8.0, 8.0), random.Random(4).gauss
    elapsed_s = 0.0
    for n in range(round(seconds / SAMPLE_S)):
        tube.step(9.5 if n > 500 else 8.0)
        elapsed_s += SAMPLE_S
        if is_lost(n):
            continue
        yield n * SAMPLE_S, tube.balloon_kpa, lag.step(tube.sensor_kpa + gauss(0, 0.0103), elapsed_s)
        elapsed_s = 0.0


@pytest.mark.parametrize("every", range(1, 2 * MAX_BRIDGED_SAMPLES))
def test_the_compensation_is_stable_at_each_spacing_of_the_samples(every):
    """A filter that always uses the gain for a spacing of 2 ms would be unstable from 14 ms on."""
    for t_s, truth_kpa, shown_kpa in compensated(lambda n: n % every):
        # With few samples the measured value lags while the pressure changes.
        max_error_kpa = 0.35 if t_s > 1.6 else 1.6
        assert abs(shown_kpa - truth_kpa) < max_error_kpa, t_s


@pytest.mark.parametrize(("probability", "max_lost"), [(0.1, 15), (0.05, 50), (0.02, 50), (0.3, 5)])
def test_the_compensation_is_stable_with_random_gaps(probability, max_lost):
    draw, gap_end = random.Random(9), 0

    def is_lost(n):
        nonlocal gap_end
        if n >= gap_end and draw.random() < probability:
            gap_end = n + draw.randint(1, max_lost)
        return n < gap_end

    for t_s, truth_kpa, shown_kpa in compensated(is_lost, 12.0):
        if t_s > 1.8:
            assert abs(shown_kpa - truth_kpa) < 0.3, t_s


@pytest.mark.parametrize("error_kpa", [5.0, -5.0, 1.0])
@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("pressed_kpa", [0.0, 1.5])
def test_one_or_two_outliers_change_neither_force_nor_contact(error_kpa, count, pressed_kpa):
    harness = ChainHarness.locked()
    m = harness.move_to(8.0 + pressed_kpa, 2.0)
    before_n, contacts = m.force_n, harness.chain.tracker.contact_count
    for _ in range(count):
        assert harness.set_pressure(8.0 + pressed_kpa + error_kpa).force_n == pytest.approx(
            before_n, abs=0.05
        )
    for _ in range(300):
        assert harness.move_to(8.0 + pressed_kpa, 0.002).force_n == pytest.approx(before_n, abs=0.05)
    assert harness.chain.tracker.contact_count == contacts


@pytest.mark.parametrize("count", [1, 4])
def test_a_few_invalid_samples_do_not_end_a_contact(count):
    harness = InstrumentHarness.holding()
    harness.push_kpa = 1.5
    harness.run(1.0)
    before_n = harness.snapshot().force_n
    harness.adc_sum = 16 * 1023
    for _ in range(count):
        harness.feed()
    harness.adc_sum = None
    harness.run(1.0)
    assert harness.commands_hold
    assert harness.snapshot().force_n == pytest.approx(before_n, abs=0.02)
    assert "in_contact" in harness.snapshot().status


@pytest.mark.parametrize("setpoint_kpa", [8.0, 11.8])
def test_the_force_alarm_works_inside_and_outside_the_validated_range(setpoint_kpa):
    harness = InstrumentHarness.holding(request={"setpoint_requested_kpa": setpoint_kpa})
    harness.write_ok({"force_limit_n": 1.0})
    harness.push_kpa = 2.0
    harness.run(1.0)
    assert "force_high_alarm" in harness.snapshot().status


def test_the_force_alarm_does_not_depend_on_the_compensated_pressure():
    harness = InstrumentHarness.holding()
    harness.write_ok({"force_limit_n": 1.0})
    harness.push_kpa = 2.0
    harness.run(1.0)
    harness.instrument.chain._lag._pressure_kpa = 1e6  # a wrong estimate
    harness.feed()
    assert "force_high_alarm" in harness.snapshot().status


def measured_hold(fault, free_s, **arguments):
    """Yield measurement and true values during a press with 1.5 N for 90 s. The fault starts at 6 s."""
    waiting = {"kind": "press", "force_n": 0.0, "hold_s": free_s, "pause_s": 0.0}
    scenario = Scenario(
        doc="long hold on a drifting baseline",
        fault=[{"name": fault, "at_s": 6.0, **arguments}],
        phase=[
            {"setpoint_kpa": [8.0], "contact": [waiting, {"kind": "hold", "force_n": 1.5, "hold_s": 45.0}]}
        ],
    )
    for m, truth in measure_playback(Playback(scenario), ChainSettings()):
        if truth.force_n == 1.5:
            yield m, truth


@pytest.mark.parametrize(
    ("fault", "arguments", "free_s", "tolerance_n"),
    [
        ("balloon_warming", {}, 10.0, 0.05),
        ("leak", {"kpa_per_s": 0.01}, 10.0, 0.15),
        ("leak", {"kpa_per_s": 0.02}, 4.0, 0.5),
    ],
)
def test_the_force_of_a_long_press_remains_correct_on_a_drifting_baseline(
    fault, arguments, free_s, tolerance_n
):
    measurements = list(measured_hold(fault, free_s, **arguments))
    assert len(measurements) == 22_500
    for m, truth in measurements[500:]:
        assert m.force_n == pytest.approx(1.5, abs=tolerance_n), truth.t_s


def test_after_a_lost_baseline_there_is_no_force_until_the_next_lock():
    chain = Chain(ChainSettings())
    chain.tracker.baseline_lost = True
    chain.tracker.baseline_kpa = 8.0
    harness = ChainHarness()
    harness.chain = chain
    chain.zero.zero_kpa = 0.2
    harness.tube = Tube(8.0, 8.0)
    m = harness.move_to(8.0, 0.1)
    assert m.quality == Quality.NO_BASELINE
    assert math.isnan(m.force_n)
    harness.feed_kpa(0.2)  # vented
    assert harness.move_to(8.0, 0.5).force_n == 0.0
