"""Tests of measuring a changing force on the simulated rig. Each force is computed from past samples only.

The paper aligns the peaks of measured and true force afterwards, which removes a delay of 0.12 s. The RMSE of
the paper is then 0.578 N.
"""

import math
from dataclasses import dataclass, replace
from functools import cache

import pytest

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import LIVE_LAW
from pneuforce.instrument.studies.measured_playback import measure_playback, measure_with_each
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import Scenario

PRESSURES_KPA = (5.3, 8.0, 11.45)
MAX_RMSE_N = 0.15
MAX_PEAK_DELAY_S = 0.020
TUBE_TIME_CONSTANTS_S = (0.06, 0.042, 0.078)
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
class ForceCourse:
    """True and measured forces of each sample at one setpoint, while the balloon was locked."""

    times_s: list
    truths_n: list
    forces_n: list
    uncompensated_n: list

    @property
    def rmse_n(self):
        return _rmse(self.forces_n, self.truths_n)

    @property
    def uncompensated_rmse_n(self):
        return _rmse(self.uncompensated_n, self.truths_n)


def _rmse(forces_n, truths_n):
    squares = [(a - b) ** 2 for a, b in zip(forces_n, truths_n, strict=True)]
    return math.sqrt(sum(squares) / len(squares))


@cache
def courses(kind, setpoint_kpa, polytropic):
    """Simulate one rig. Return its forces for each tube time constant that the instrument assumes."""
    contacts = {"slow": SLOW, "fast": FAST, "overlapping": OVERLAPPING}[kind]
    scenario = Scenario(
        doc="continuous",
        seed=3,
        pneumatics={"leak_kpa_per_s": 0.01, "tube_time_constant_s": 0.06, "polytropic": polytropic},
        sensor={"noise_counts": 0.7},
        phase=[{"setpoint_kpa": [setpoint_kpa], "contact": contacts}],
    )
    assumed_s = TUBE_TIME_CONSTANTS_S if polytropic == 1.0 else (0.06,)
    by_assumption = {tube_time_constant_s: ForceCourse([], [], [], []) for tube_time_constant_s in assumed_s}
    settings = [
        ChainSettings(
            law=replace(LIVE_LAW, sides=2),
            filter_time_constant_s=0.06,
            tube_time_constant_s=tube_time_constant_s,
        )
        for tube_time_constant_s in assumed_s
    ]
    for measurements, truth in measure_with_each(Playback(scenario), settings):
        for m, course in zip(measurements, by_assumption.values(), strict=True):
            if math.isfinite(m.rise_kpa):
                course.times_s.append(truth.t_s)
                course.truths_n.append(truth.force_n)
                course.forces_n.append(m.force_n)
                course.uncompensated_n.append(m.force_uncompensated_n)
    return by_assumption


def course(kind, setpoint_kpa, assumed_tube_s=0.06, polytropic=1.0):
    return courses(kind, setpoint_kpa, polytropic)[assumed_tube_s]


each_pressure = pytest.mark.parametrize("setpoint_kpa", PRESSURES_KPA)
each_kind = pytest.mark.parametrize("kind", ["slow", "fast", "overlapping"])


@each_pressure
@each_kind
def test_the_rmse_of_the_force_is_at_most_0_15_n(kind, setpoint_kpa):
    assert course(kind, setpoint_kpa).rmse_n <= MAX_RMSE_N


@each_pressure
def test_without_compensation_the_rmse_is_more_than_three_times_larger(setpoint_kpa):
    fast = course("fast", setpoint_kpa)
    assert fast.uncompensated_rmse_n > 3 * fast.rmse_n


def peaks_of(times_s, forces_n, bounds):
    """Yield the time of the peak in each span of time.

    The time of the peak is the mean time of all samples above 95 % of the peak. The time of the highest
    sample alone would depend on noise, because the top of a press is flat.
    """
    for low_s, high_s in bounds:
        inside = [(f, t) for t, f in zip(times_s, forces_n, strict=True) if low_s <= t <= high_s]
        high_n = 0.95 * max(inside)[0]
        top_s = [t for f, t in inside if f >= high_n]
        yield sum(top_s) / len(top_s)


def contacts_of(course):
    """Yield the start and the end [s] of each press of the hand."""
    begun_s = None
    for t_s, truth_n in zip(course.times_s, course.truths_n, strict=True):
        if truth_n > 0 and begun_s is None:
            begun_s = t_s
        elif truth_n == 0 and begun_s is not None:
            yield begun_s, t_s
            begun_s = None


@each_pressure
def test_the_peak_of_a_fast_contact_is_shown_within_20_ms(setpoint_kpa):
    fast = course("fast", setpoint_kpa)
    bounds = list(contacts_of(fast))
    true_s = peaks_of(fast.times_s, fast.truths_n, bounds)
    shown_s = peaks_of(fast.times_s, fast.forces_n, bounds)
    late_s = [shown - true for shown, true in zip(shown_s, true_s, strict=True)]
    assert len(late_s) == len(FAST)
    assert max(abs(late) for late in late_s) <= MAX_PEAK_DELAY_S, late_s


@each_pressure
@each_kind
@pytest.mark.parametrize(("assumed_tube_s", "polytropic"), [(0.042, 1.0), (0.078, 1.0), (0.06, 1.4)])
def test_with_a_wrong_time_constant_or_gas_exponent_the_rmse_is_at_most_0_225_n(
    kind, setpoint_kpa, assumed_tube_s, polytropic
):
    assert course(kind, setpoint_kpa, assumed_tube_s, polytropic).rmse_n <= 1.5 * MAX_RMSE_N


@pytest.mark.parametrize("n_per_s", [1.0, 10.0])
@each_pressure
def test_a_contact_is_detected_before_the_force_exceeds_0_6_n(setpoint_kpa, n_per_s):
    ramp = {"kind": "ramp", "force_n": 3.0, "rate_n_per_s": n_per_s, "pause_s": 1.0}
    scenario = Scenario(doc="onset", phase=[{"setpoint_kpa": [setpoint_kpa], "repeat": 2, "contact": [ramp]}])
    seen_n, before = [], False
    for m, truth in measure_playback(Playback(scenario), ChainSettings()):
        if m.in_contact and not before:
            seen_n.append(truth.force_n)
        before = m.in_contact
    assert len(seen_n) == 2
    assert max(seen_n) <= 0.6
