"""Tests of the fit of the tube's lag, with pressure steps of the simulated circuit and sensor."""

import math

import numpy as np
import pytest

from pneuforce.instrument.calibration.lag import fit_lag
from pneuforce.protocol.frames import Valve
from pneuforce.protocol.limits import nominal_pressure_kpa
from pneuforce.sim.plants.plant import BalloonState
from pneuforce.sim.pneumatics import Pneumatics, PneumaticSettings
from pneuforce.sim.sensor import Sensor, SensorSettings
from tests.instrument.calibration.points import error_message, points, share_within

DT_S = 0.002


def recorded(tube_time_constant_s=0.06, seed=1, after_kpa=5.0, filter_time_constant_s=0.0, seconds=1.0):
    """Return the recorded pressure of a balloon that is released after 0.2 s.

    The recording contains the effects of tube and sensor. If `filter_time_constant_s` is not 0, it also
    contains the effect of the filter.
    """
    circuit = Pneumatics(
        PneumaticSettings(tube_time_constant_s=tube_time_constant_s),
        0.0,
        sensor_kpa=8.0,
        powered_valves=Valve.VENT_CLOSED,
    )
    sensor = Sensor(SensorSettings(), seed)
    sensor.adc_sum(8.0, 1.0)
    pressures, filtered = [], math.nan
    for n in range(round(seconds / DT_S)):
        balloon_kpa = 8.0 if n < 100 else after_kpa
        circuit.step(BalloonState(balloon_kpa, 0.0, 0.0, 2500.0), Valve.VENT_CLOSED, DT_S)
        read = nominal_pressure_kpa(sensor.adc_sum(circuit.sensor_kpa, DT_S))
        gain = -math.expm1(-DT_S / filter_time_constant_s) if filter_time_constant_s else 1.0
        filtered = filtered + gain * (read - filtered) if n else read
        pressures.append(filtered)
    return points(t_s=np.arange(len(pressures)) * DT_S, pressure_kpa=pressures)


@pytest.mark.parametrize("filter_time_constant_s", [0.0, 0.03, 0.06])
def test_the_lag_lies_within_its_stated_uncertainty(filter_time_constant_s):
    fits = [
        fit_lag(recorded(seed=n, filter_time_constant_s=filter_time_constant_s), filter_time_constant_s)
        for n in range(60)
    ]
    errors, stds = [fit.tube_time_constant_s - 0.06 for fit in fits], [fit.std_s for fit in fits]
    assert max(stds) < 0.003
    # The response time of the sensor is 1 ms, which the fit cannot separate from the lag.
    assert abs(np.mean(errors)) < 0.0006
    assert 0.5 <= share_within(errors, stds) <= 0.86
    assert share_within(errors, stds, 3) >= 0.95


@pytest.mark.parametrize("tube_time_constant_s", [0.02, 0.06, 0.15])
def test_long_and_short_tubes_are_distinguished(tube_time_constant_s):
    assert fit_lag(recorded(tube_time_constant_s, seconds=1.5)).tube_time_constant_s == pytest.approx(
        tube_time_constant_s, rel=0.04
    )


def test_a_rising_step_gives_the_same_lag_as_a_falling_step():
    assert fit_lag(recorded(after_kpa=11.0)).tube_time_constant_s == pytest.approx(0.06, rel=0.03)


def ramp():
    t = np.arange(500) * DT_S
    return points(t_s=t, pressure_kpa=8 - np.clip((t - 0.2) / 0.6, 0, 1) * 4)


def oscillation():
    t = np.arange(500) * DT_S
    elapsed = np.maximum(t - 0.2, 0)
    return points(t_s=t, pressure_kpa=4 + 4 * np.exp(-elapsed / 0.1) * np.cos(elapsed / 0.02))


@pytest.mark.parametrize(
    ("recording", "expected"),
    [
        (lambda: recorded(after_kpa=8.0), "no step: 8."),
        (lambda: recorded(after_kpa=7.8), "a step of at least 0.50 kPa"),
        (lambda: points(t_s=np.arange(40) / 500, pressure_kpa=np.linspace(8e3, 5e3, 40)), "hPa or Pa?"),
        (ramp, "not a step through a first-order lag"),
        (oscillation, "not a step through a first-order lag"),
        (lambda: recorded(filter_time_constant_s=0.06), "--filter-time-constant-s"),
        (lambda: points(t_s=[0.0, 0.1], pressure_kpa=[8.0, 5.0]), "2 points, and at least 30"),
        (lambda: points(t_s=np.zeros(40), pressure_kpa=np.linspace(8, 5, 40)), "line 3: t_s does not grow"),
        (lambda: points(t_s=np.arange(40.0) * 2, pressure_kpa=np.linspace(8, 5, 40)), "in milliseconds?"),
    ],
)
def test_a_recording_without_a_first_order_step_is_rejected(recording, expected):
    assert expected in error_message(fit_lag, recording())
