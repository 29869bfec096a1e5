"""The lag of the tube, from a step that the simulated circuit and sensor show."""

import math

import numpy as np
import pytest

from instrument.calibration.lag import lag_of
from instrument.rig.frames import Valve
from instrument.rig.limits import nominal_pressure_kpa
from sim.plant import BalloonState
from sim.pneumatics import Pneumatics, PneumaticSettings
from sim.sensor import Sensor, SensorSettings
from tests.instrument.calibration.points import points, refusal_of, share_within

DT_S = 0.002


def recorded(tube_s=0.06, seed=1, after_kpa=5.0, filter_s=0.0, seconds=1.0):
    """A balloon that is let go after 0.2 s, through tube, sensor and perhaps a filter."""
    circuit = Pneumatics(PneumaticSettings(tube_s=tube_s), 0.0, sensor_kpa=8.0, told=Valve.VENT_CLOSED)
    sensor = Sensor(SensorSettings(), seed)
    sensor.adc_sum(8.0, 1.0)
    shown, filtered = [], math.nan
    for n in range(round(seconds / DT_S)):
        balloon_kpa = 8.0 if n < 100 else after_kpa
        circuit.step(BalloonState(balloon_kpa, 0.0, 0.0, 2500.0), Valve.VENT_CLOSED, DT_S)
        read = nominal_pressure_kpa(sensor.adc_sum(circuit.sensor_kpa, DT_S))
        share = -math.expm1(-DT_S / filter_s) if filter_s else 1.0
        filtered = filtered + share * (read - filtered) if n else read
        shown.append(filtered)
    return points(t_s=np.arange(len(shown)) * DT_S, pressure_kpa=shown)


@pytest.mark.parametrize("filter_s", [0.0, 0.03, 0.06])
def test_the_lag_lies_within_its_stated_uncertainty(filter_s):
    draws = [lag_of(recorded(seed=n, filter_s=filter_s), filter_s) for n in range(60)]
    errors, stds = [draw.tube_s - 0.06 for draw in draws], [draw.std_s for draw in draws]
    assert max(stds) < 0.003
    assert (
        abs(np.mean(errors)) < 0.0006
    )  # the sensor's own answer takes 1 ms and may not be told from a delay
    assert 0.5 <= share_within(errors, stds) <= 0.86
    assert share_within(errors, stds, 3) >= 0.95


@pytest.mark.parametrize("tube_s", [0.02, 0.06, 0.15])
def test_long_and_short_tubes_are_told_apart(tube_s):
    assert lag_of(recorded(tube_s, seconds=1.5)).tube_s == pytest.approx(tube_s, rel=0.04)


def test_a_rise_tells_as_much_as_a_fall():
    assert lag_of(recorded(after_kpa=11.0)).tube_s == pytest.approx(0.06, rel=0.03)


def ramp():
    t = np.arange(500) * DT_S
    return points(t_s=t, pressure_kpa=8 - np.clip((t - 0.2) / 0.6, 0, 1) * 4)


def rung():
    t = np.arange(500) * DT_S
    since = np.maximum(t - 0.2, 0)
    return points(t_s=t, pressure_kpa=4 + 4 * np.exp(-since / 0.1) * np.cos(since / 0.02))


@pytest.mark.parametrize(
    ("recording", "said"),
    [
        (lambda: recorded(after_kpa=8.0), "no step: 8."),
        (lambda: recorded(after_kpa=7.8), "a step of at least 0.50 kPa"),
        (lambda: points(t_s=np.arange(40) / 500, pressure_kpa=np.linspace(8e3, 5e3, 40)), "hPa or Pa?"),
        (ramp, "not a step through a first-order lag"),
        (rung, "not a step through a first-order lag"),
        (lambda: recorded(filter_s=0.06), "(--filter-s)"),
        (lambda: points(t_s=[0.0, 0.1], pressure_kpa=[8.0, 5.0]), "2 points, and at least 30"),
        (lambda: points(t_s=np.zeros(40), pressure_kpa=np.linspace(8, 5, 40)), "line 3: t_s does not grow"),
        (lambda: points(t_s=np.arange(40.0) * 2, pressure_kpa=np.linspace(8, 5, 40)), "in milliseconds?"),
    ],
)
def test_what_is_no_step_through_a_first_order_lag_is_refused(recording, said):
    assert said in refusal_of(lag_of, recording())
