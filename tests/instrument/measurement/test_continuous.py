"""The force while it changes: the whole rig in virtual time, measured without hindsight.

The paper removes its delay of 0.12 s afterwards, by aligning the peaks, and errs by 0.578 N (RMSE).
"""

import math
from dataclasses import dataclass
from functools import cache

import pytest

from instrument.chain import ChainSettings
from instrument.cli.measured_scenario import measured, measured_by_each
from sim.headless import Playback
from sim.scenario import Scenario

PRESSURES_KPA = (5.3, 8.0, 11.45)
MOST_RMSE_N = 0.15
LATEST_PEAK_S = 0.020
BELIEFS_S = (0.06, 0.042, 0.078)
PRESS = {"kind": "press", "pause_s": 1.5}
SLOW = [PRESS | {"force_n": 2.0, "rise_s": 1.0, "hold_s": 0.5}, PRESS | {"force_n": 3.0, "rise_s": 1.5}]
FAST = [
    PRESS | {"force_n": force_n, "rise_s": rise_s, "hold_s": 0.0}
    for force_n, rise_s in ((2.5, 0.40), (1.2, 0.20), (3.0, 0.48), (1.8, 0.30))
]
OVERLAPPING = [
    {"kind": "fast", "force_n": [1.8, 2.2, 1.5], "eased": eased, "pause_s": 1.5} for eased in (0.0, 0.15)
]


@dataclass
class Course:
    """Forces at one setpoint, sample by sample, while the balloon was held."""

    times_s: list
    truths_n: list
    forces_n: list
    lagging_n: list

    @property
    def rmse_n(self):
        return _rmse(self.forces_n, self.truths_n)

    @property
    def lagging_rmse_n(self):
        return _rmse(self.lagging_n, self.truths_n)


def _rmse(forces_n, truths_n):
    squares = [(a - b) ** 2 for a, b in zip(forces_n, truths_n, strict=True)]
    return math.sqrt(sum(squares) / len(squares))


@cache
def courses(kind, setpoint_kpa, polytropic):
    """One rig, followed by an instrument for each belief about its tube: the course by belief."""
    contacts = {"slow": SLOW, "fast": FAST, "overlapping": OVERLAPPING}[kind]
    scenario = Scenario(
        doc="continuous",
        seed=3,
        pneumatics={"leak_kpa_per_s": 0.01, "tube_s": 0.06, "polytropic": polytropic},
        sensor={"noise_counts": 0.7},
        phase=[{"setpoint_kpa": [setpoint_kpa], "contact": contacts}],
    )
    beliefs_s = BELIEFS_S if polytropic == 1.0 else (0.06,)
    followed = {tube_s: Course([], [], [], []) for tube_s in beliefs_s}
    settings = [ChainSettings(filter_s=0.06, tube_s=tube_s) for tube_s in beliefs_s]
    for measurements, truth in measured_by_each(Playback(scenario), settings):
        for m, course in zip(measurements, followed.values(), strict=True):
            if math.isfinite(m.rise_kpa):
                course.times_s.append(truth.t_s)
                course.truths_n.append(truth.force_n)
                course.forces_n.append(m.force_n)
                course.lagging_n.append(m.force_uncompensated_n)
    return followed


def course(kind, setpoint_kpa, believed_s=0.06, polytropic=1.0):
    return courses(kind, setpoint_kpa, polytropic)[believed_s]


each_pressure = pytest.mark.parametrize("setpoint_kpa", PRESSURES_KPA)
each_kind = pytest.mark.parametrize("kind", ["slow", "fast", "overlapping"])


@each_pressure
@each_kind
def test_the_force_follows_within_0_15_n_without_hindsight(kind, setpoint_kpa):
    assert course(kind, setpoint_kpa).rmse_n <= MOST_RMSE_N


@each_pressure
def test_without_compensation_it_would_err_by_three_times_as_much(setpoint_kpa):
    fast = course("fast", setpoint_kpa)
    assert fast.lagging_rmse_n > 3 * fast.rmse_n


def peaks_of(times_s, forces_n, bounds):
    """Time of the peak within each of some stretches of time: the middle of the time above 95 % of it.

    (The single highest sample scatters by noise: the top of a press is flat.)
    """
    for low_s, high_s in bounds:
        inside = [(f, t) for t, f in zip(times_s, forces_n, strict=True) if low_s <= t <= high_s]
        high_n = 0.95 * max(inside)[0]
        top_s = [t for f, t in inside if f >= high_n]
        yield sum(top_s) / len(top_s)


def contacts_of(course):
    """Stretches of time in which the hand presses."""
    begun_s = None
    for t_s, truth_n in zip(course.times_s, course.truths_n, strict=True):
        if truth_n > 0 and begun_s is None:
            begun_s = t_s
        elif truth_n == 0 and begun_s is not None:
            yield begun_s, t_s
            begun_s = None


@each_pressure
def test_the_peak_of_a_fast_contact_comes_within_20_ms(setpoint_kpa):
    fast = course("fast", setpoint_kpa)
    bounds = list(contacts_of(fast))
    true_s = peaks_of(fast.times_s, fast.truths_n, bounds)
    shown_s = peaks_of(fast.times_s, fast.forces_n, bounds)
    late_s = [shown - true for shown, true in zip(shown_s, true_s, strict=True)]
    assert len(late_s) == len(FAST)
    assert max(abs(late) for late in late_s) <= LATEST_PEAK_S, late_s


@each_pressure
@each_kind
@pytest.mark.parametrize(("believed_s", "polytropic"), [(0.042, 1.0), (0.078, 1.0), (0.06, 1.2), (0.06, 1.4)])
def test_a_lag_that_is_a_third_wrong_or_gas_that_heats_costs_no_more_than_half_as_much_again(
    kind, setpoint_kpa, believed_s, polytropic
):
    assert course(kind, setpoint_kpa, believed_s, polytropic).rmse_n <= 1.5 * MOST_RMSE_N


@pytest.mark.parametrize("n_per_s", [1.0, 10.0])
@each_pressure
def test_a_contact_is_seen_before_the_force_passes_0_6_n(setpoint_kpa, n_per_s):
    ramp = {"kind": "ramp", "force_n": 3.0, "rate_n_per_s": n_per_s, "pause_s": 1.0}
    scenario = Scenario(doc="onset", phase=[{"setpoint_kpa": [setpoint_kpa], "repeat": 4, "contact": [ramp]}])
    seen_n, before = [], False
    for m, truth in measured(Playback(scenario), ChainSettings()):
        if m.in_contact and not before:
            seen_n.append(truth.force_n)
        before = m.in_contact
    assert len(seen_n) == 4
    assert max(seen_n) <= 0.6
