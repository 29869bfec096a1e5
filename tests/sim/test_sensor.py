import math

import numpy as np
import pytest

from pneuforce.protocol.frames import ADC_FULL_SCALE, MAX_ADC_SUM
from pneuforce.sim.sensor import Sensor, SensorSettings

DT_S = 0.002


def settled(pressure_kpa, **settings):
    sensor = Sensor(SensorSettings(**settings), seed=1)
    for _ in range(20):
        sensor.adc_sum(pressure_kpa, DT_S)
    return sensor


def sums(pressure_kpa, count=500, **settings):
    sensor = settled(pressure_kpa, **settings)
    return [sensor.adc_sum(pressure_kpa, DT_S) for _ in range(count)]


def read_kpa(sums):
    """Return the pressure of a mean ADC sum. Each of 16 conversions truncates half a count on average."""
    return ((sum(sums) / len(sums) + 8) / ADC_FULL_SCALE - 0.04) / 0.018


@pytest.mark.parametrize("pressure_kpa", [0.0, 8.0, 25.0])
def test_the_sensor_follows_its_data_sheet(pressure_kpa):
    assert read_kpa(sums(pressure_kpa, zero_offset_kpa=0.25)) == pytest.approx(pressure_kpa + 0.25, abs=0.001)


def test_the_noise_of_one_conversion_is_0_7_counts():
    """The noise of a sum is √16 times the noise of a conversion. A conversion adds √(1/12) by rounding."""
    values = sums(8.0, 4000)
    mean = sum(values) / len(values)
    rms = (sum((v - mean) ** 2 for v in values) / len(values)) ** 0.5
    assert rms == pytest.approx(4 * (0.7**2 + 1 / 12) ** 0.5, rel=0.05)


@pytest.mark.parametrize("pressure_kpa", [-2.4, -2.3, -2.22, -2.0, 0.0, 8.0, 20.3, 52.8, 53.2, 53.4])
def test_a_sum_equals_16_separate_conversions(pressure_kpa):
    sensor = Sensor(SensorSettings(zero_offset_kpa=0.0), seed=7)
    noise = np.random.default_rng(7).normal(0.0, 0.7, (500, 16))
    for n, each in enumerate(noise):
        level = 1024 * (0.018 * pressure_kpa * (1 - math.exp(-(n + 1) * DT_S / 0.001)) + 0.04)
        one_by_one = sum(min(max(math.floor(level + x), 0), 1023) for x in each.tolist())
        assert sensor.adc_sum(pressure_kpa, DT_S) == one_by_one


def test_the_adc_saturates():
    assert sums(60.0, 5) == [16 * 1023] * 5
    assert sums(-10.0, 5) == [0] * 5


def test_offset_gain_and_bow_add_up():
    settings = SensorSettings(zero_offset_kpa=-0.3, gain_error=0.01, bow_kpa=0.2)
    assert settings.error_kpa(0.0) == pytest.approx(-0.3)
    assert settings.error_kpa(25.0) == pytest.approx(-0.3 + 0.25 + 0.2)
    assert settings.error_kpa(50.0) == pytest.approx(-0.3 + 0.5)
    read = read_kpa(sums(10.0, zero_offset_kpa=-0.3, gain_error=0.01, bow_kpa=0.2))
    assert read == pytest.approx(10 + settings.error_kpa(10.0), abs=0.001)


@pytest.mark.parametrize(
    ("settings", "fact"),
    [
        ({"zero_offset_kpa": 1.0, "gain_error": 0.01}, "error of 1.50 kPa; .* allows 1.25 kPa"),
        ({"zero_offset_kpa": 0.0, "bow_kpa": -1.3}, "error of 1.30 kPa"),
        (
            {"zero_offset_kpa": float("nan")},
            "zero_offset_kpa.* allows 1.25 kPa",
        ),
        ({"noise_counts": -1.0}, "noise_counts is -1"),
        ({"ripple_mv": 900.0}, "ripple_mv is 900"),
    ],
)
def test_a_sensor_outside_the_data_sheet_is_rejected(settings, fact):
    with pytest.raises(ValueError, match=fact):
        SensorSettings(**settings)


def test_faults_of_the_sensor_change_the_sum():
    sensor = settled(8.0)
    healthy = sensor.adc_sum(8.0, DT_S)
    sensor.frozen = True
    assert [sensor.adc_sum(4.0, DT_S) for _ in range(50)] == [healthy] * 50
    sensor.frozen = False
    assert sensor.adc_sum(4.0, DT_S) < healthy - 500
    for stuck_at in (MAX_ADC_SUM, 0):
        sensor.stuck_at = stuck_at
        assert sensor.adc_sum(4.0, DT_S) == stuck_at
    sensor.stuck_at, sensor.drift_kpa = None, 4.0
    assert read_kpa([sensor.adc_sum(4.0, DT_S) for _ in range(500)]) == pytest.approx(8.25, abs=0.01)


def test_the_supply_ripple_has_the_configured_amplitude():
    sensor = settled(0.0, ripple_mv=30.0)
    ripple_mv = [sensor.ripple_mv(n * DT_S) for n in range(200)]
    assert max(ripple_mv) == pytest.approx(30, abs=1)
    assert min(ripple_mv) == pytest.approx(-30, abs=1)
    assert settled(0.0).ripple_mv(0.1) == 0
