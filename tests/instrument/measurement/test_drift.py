"""An hour of a locked balloon that is not touched: warming gas, creeping latex, a slow leak."""

from functools import cache

import numpy as np
import pytest

from instrument.chain import Chain, ChainSettings
from instrument.contact import TRACKING_KPA_PER_S
from instrument.rig.frames import BoardState, Sample, Valve
from instrument.rig.link import RawSample
from sim.plant import amount_kpa_mm3
from sim.pneumatics import Pneumatics, PneumaticSettings
from sim.published import PublishedPlant
from tests.instrument.driving import DT_S, adc_sum_of

HOUR_S = 3600
COARSE_S = 0.1
NOISE_COUNTS = 4 * (0.7**2 + 1 / 12) ** 0.5  # of a sum of 16
PLANT = PublishedPlant()
INSERTED, CIRCUIT_WARMED = 15.0, 2.0  # kelvin


@cache
def locked_hour(setpoint_kpa, balloon_k=0.0, circuit_k=0.0, creep=0.0, seconds=HOUR_S):
    """Pressure that reaches the sensor, each 0.1 s; warmed after 10 s."""
    settings = PneumaticSettings(creep=creep, creep_s=600.0, leak_kpa_per_s=0.0003)
    pneumatics = Pneumatics(settings, amount_kpa_mm3(PLANT, setpoint_kpa), setpoint_kpa, Valve.VENT_CLOSED)
    course = []
    for step in range(round(seconds / COARSE_S)):
        if step == round(10 / COARSE_S):
            pneumatics.balloon_warmth.target_k, pneumatics.circuit_warmth.target_k = balloon_k, circuit_k
        pneumatics.step(PLANT.settle(pneumatics.gas, 0.0), Valve.VENT_CLOSED, COARSE_S)
        course.append(pneumatics.sensor_kpa)
    return np.array(course)


@pytest.mark.parametrize(
    ("setpoint_kpa", "balloon_k", "circuit_k", "moved_kpa"),
    [(8.0, INSERTED, 0.0, 0.45), (5.0, 0.0, CIRCUIT_WARMED, 0.40), (8.0, 0.0, CIRCUIT_WARMED, 0.33)],
)
def test_warming_moves_the_locked_pressure_as_physics_says(setpoint_kpa, balloon_k, circuit_k, moved_kpa):
    """15 K on the balloon's gas: 0.45 kPa. 2 K on the circuit's: 0.4 kPa, less in a softer balloon."""
    moved = locked_hour(setpoint_kpa, balloon_k, circuit_k) - locked_hour(setpoint_kpa)
    assert moved.max() == pytest.approx(moved_kpa, abs=0.05)


def test_an_hour_of_warming_and_creep_is_drift_and_not_a_contact():
    course = locked_hour(8.0, INSERTED, CIRCUIT_WARMED, creep=0.02)
    times_s = np.arange(0, HOUR_S - 1, DT_S)
    pressures = np.interp(times_s, COARSE_S * np.arange(len(course)), course)
    noise = np.random.default_rng(5).normal(0.0, NOISE_COUNTS, len(times_s))
    sums = np.rint(adc_sums(pressures) + noise).astype(int).tolist()
    chain = Chain(ChainSettings())
    chain.zero.zero_kpa = 0.0
    raw_of = {adc_sum: held(adc_sum) for adc_sum in set(sums)}
    drifts, errors = [], []
    for n, adc_sum in enumerate(sums):
        m = chain.step(raw_of[adc_sum])
        assert m.force_n == 0.0, f"a force {times_s[n]:.1f} s after the lock"
        if n % 500 == 0:
            drifts.append(chain.tracker.drift_kpa_per_s)
            errors.append(m.initial_kpa - pressures[n])
    assert chain.tracker.count == 0
    assert max(abs(error) for error in errors) < 0.02
    assert 0.005 < max(drifts) < TRACKING_KPA_PER_S


def held(adc_sum):
    sample = Sample(0, adc_sum, 5000, Valve.VENT_CLOSED, BoardState.HOLDING, 0, 0, 0, 8000)
    return RawSample(0, 0.0, sample, DT_S)


def adc_sums(pressures_kpa):
    """The transfer function of `adc_sum_of`, on an array and without rounding."""
    low, high = adc_sum_of(0.0), adc_sum_of(50.0)
    return low + (high - low) * pressures_kpa / 50.0
