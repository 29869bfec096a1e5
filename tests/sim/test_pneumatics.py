import pytest

from instrument.rig.frames import ADC_FULL_SCALE, Valve
from sim.plant import amount_kpa_mm3
from sim.pneumatics import Pneumatics, PneumaticSettings
from sim.published import PublishedPlant
from sim.sensor import Sensor, SensorSettings

PLANT = PublishedPlant()
FILL = Valve.INLET_OPEN | Valve.VENT_CLOSED
DT_S = 0.002


def circuit(start_kpa, **settings):
    return Pneumatics(
        PneumaticSettings(**settings), amount_kpa_mm3(PLANT, start_kpa), start_kpa, Valve.VENT_CLOSED
    )


def pressure_after(seconds, circuit, valves):
    for _ in range(round(seconds / DT_S)):
        circuit.step(PLANT.settle(circuit.gas, 0), valves, DT_S)
    return PLANT.settle(circuit.gas, 0).pressure_kpa


@pytest.mark.parametrize("start_kpa", [3.0, 5.0, 8.0])
def test_the_inlet_inflates_at_4_to_7_kpa_per_second(start_kpa):
    rise = pressure_after(0.112, circuit(start_kpa), FILL) - start_kpa
    assert 4 <= rise / 0.1 <= 7


def test_the_vent_empties_the_balloon_in_two_seconds():
    assert pressure_after(2.0, circuit(12.0), Valve.NONE) < 0.1


def test_both_valves_open_leave_less_than_5_kpa():
    assert 1 < pressure_after(10, circuit(8.0), Valve.INLET_OPEN) < 5


def test_locked_it_leaks_as_configured():
    fall = 8.0 - pressure_after(10, circuit(8.0, leak_kpa_per_s=0.01), Valve.VENT_CLOSED)
    assert fall == pytest.approx(0.1, rel=0.1)


def test_a_valve_moves_12_ms_after_it_was_told_and_a_short_pulse_is_delayed_whole():
    own = circuit(8.0)
    told = [FILL, FILL] + [Valve.VENT_CLOSED] * 10
    open_at = []
    for n, valves in enumerate(told):
        own.step(PLANT.settle(own.gas, 0), valves, DT_S)
        open_at += [n] if own.inlet.open else []
    assert len(open_at) == 2
    assert open_at[0] * DT_S == pytest.approx(0.012, abs=DT_S)


def test_the_tube_lags_by_its_time_constant():
    own = circuit(10.0)
    own.sensor_kpa = 0.0
    pressure_after(0.06, own, Valve.VENT_CLOSED)
    assert own.sensor_kpa == pytest.approx(6.32, abs=0.01)


def sums(pressure_kpa, count=500, **settings):
    sensor = Sensor(SensorSettings(**settings), seed=1)
    for _ in range(20):
        sensor.adc_sum(pressure_kpa, DT_S)
    return [sensor.adc_sum(pressure_kpa, DT_S) for _ in range(count)]


@pytest.mark.parametrize("pressure_kpa", [0.0, 8.0, 25.0])
def test_the_sensor_follows_its_data_sheet(pressure_kpa):
    """Truncation takes half a count of each conversion."""
    mean = sum(sums(pressure_kpa, zero_offset_kpa=0.25)) / 500
    ratio = (mean + 8) / ADC_FULL_SCALE
    assert ratio == pytest.approx(0.018 * (pressure_kpa + 0.25) + 0.04, abs=0.00002)


def test_the_noise_is_07_counts_of_one_conversion():
    """Of a sum: √16 times that, and the √(1/12) of rounding joins it."""
    values = sums(8.0, 4000)
    mean = sum(values) / len(values)
    rms = (sum((v - mean) ** 2 for v in values) / len(values)) ** 0.5
    assert rms == pytest.approx(4 * (0.7**2 + 1 / 12) ** 0.5, rel=0.05)


def test_the_adc_saturates():
    assert sums(60.0, 5) == [16 * 1023] * 5
    assert sums(-10.0, 5) == [0] * 5
