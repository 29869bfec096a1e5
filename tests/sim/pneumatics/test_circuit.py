"""Tests of the pneumatic circuit with the balloon of the paper."""

import pytest

from pneuforce.protocol.frames import Valve
from pneuforce.sim.plants.plant import amount_kpa_mm3
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.pneumatics import Pneumatics, PneumaticSettings

PLANT = PublishedPlant()
LOCKED, FILL = int(Valve.VENT_CLOSED), int(Valve.INLET_OPEN | Valve.VENT_CLOSED)
SAFE = int(Valve.NONE)
DT_S = 0.002


def circuit(start_kpa, **overrides):
    """Return a circuit with shut valves. By default, it has no leak."""
    settings = PneumaticSettings(**{"leak_kpa_per_s": 0.0, **overrides})
    outside_kpa = settings.ambient_kpa + settings.reference_kpa
    amount = amount_kpa_mm3(PLANT, start_kpa, settings.tubes_mm3, outside_kpa)
    return Pneumatics(settings, amount, start_kpa + settings.reference_kpa, LOCKED)


def pressures_during(seconds, circuit, valves, force_n=0.0):
    """Return the pressures in the balloon after each step."""
    pressures_kpa = []
    for _ in range(round(seconds / DT_S)):
        circuit.step(PLANT.settle(circuit.gas, force_n), valves, DT_S)
        pressures_kpa.append(PLANT.settle(circuit.gas, force_n).pressure_kpa)
    return pressures_kpa


def pressure_after(seconds, circuit, valves):
    return pressures_during(seconds, circuit, valves)[-1]


@pytest.mark.parametrize("start_kpa", [3.0, 5.0, 8.0])
def test_the_inlet_inflates_at_4_to_7_kpa_per_second(start_kpa):
    rise = pressure_after(0.112, circuit(start_kpa), FILL) - start_kpa
    assert 4 <= rise / 0.1 <= 7


def test_the_vent_empties_the_balloon_in_two_seconds():
    assert pressure_after(2.0, circuit(12.0), SAFE) < 0.1


def test_with_both_valves_open_the_pressure_falls_below_5_kpa():
    assert 1 < pressure_after(10, circuit(8.0), int(Valve.INLET_OPEN)) < 5


def test_a_locked_circuit_leaks_as_configured():
    fall = 8.0 - pressure_after(10, circuit(8.0, leak_kpa_per_s=0.01), LOCKED)
    assert fall == pytest.approx(0.1, rel=0.1)


def test_a_valve_moves_12_ms_after_its_command_and_a_short_pulse_keeps_its_length():
    pneumatics = circuit(8.0)
    commands = [FILL, FILL] + [LOCKED] * 10
    open_at = []
    for n, valves in enumerate(commands):
        pressures_during(DT_S, pneumatics, valves)
        open_at += [n] if pneumatics.inlet.open else []
    assert len(open_at) == 2
    assert open_at[0] * DT_S == pytest.approx(0.012, abs=DT_S)


def test_the_tube_lags_by_its_time_constant():
    pneumatics = circuit(10.0)
    pneumatics.sensor_kpa = 0.0
    pressure_after(0.06, pneumatics, LOCKED)
    assert pneumatics.sensor_kpa == pytest.approx(6.32, abs=0.01)


def test_tubes_of_twice_the_volume_fill_more_slowly():
    narrow, wide = (pressure_after(0.2, circuit(5.0, tubes_mm3=v), FILL) for v in (12.68e3, 25.36e3))
    assert wide - 5 < 0.8 * (narrow - 5)


def test_no_gas_enters_through_a_shut_supply_or_an_inlet_that_is_stuck_shut():
    shut, stuck = circuit(5.0), circuit(5.0)
    shut.supply.shut = True
    stuck.inlet.stuck = False
    assert pressure_after(0.5, shut, FILL) == pytest.approx(5)
    assert pressure_after(0.5, stuck, FILL) == pytest.approx(5)


def test_no_gas_flows_back_into_an_empty_tank():
    pneumatics = circuit(5.0)
    pneumatics.supply.tank_kpa, pneumatics.supply.compressor_works = 0.0, False
    assert pressure_after(0.5, pneumatics, FILL) == pytest.approx(5)


def test_a_vent_that_is_stuck_shut_empties_nothing():
    pneumatics = circuit(8.0)
    pneumatics.vent.stuck = False
    assert pressure_after(1.0, pneumatics, SAFE) == pytest.approx(8)


@pytest.mark.parametrize("occluded", [False, True])
def test_a_burst_balloon_loses_half_of_its_pressure_in_50_ms_and_stays_empty(occluded):
    pneumatics = circuit(8.0)
    pneumatics.burst, pneumatics.occluded = True, occluded
    pressures = pressures_during(0.5, pneumatics, LOCKED)
    assert pressures[25] < 4
    assert all(pressure > -1e-6 for pressure in pressures)
    assert pressures[-1] == pytest.approx(0, abs=0.01)


def test_an_occluded_balloon_keeps_its_gas_and_the_sensor_reads_empty_tubes():
    pneumatics = circuit(8.0)
    pneumatics.occluded = True
    assert pressure_after(1.5, pneumatics, SAFE) == pytest.approx(8)
    assert pneumatics.sensor_kpa == pytest.approx(0, abs=0.01)


def test_after_an_occlusion_the_gas_of_tubes_and_balloon_mixes():
    pneumatics = circuit(8.0)
    before_kpa_mm3 = pneumatics.gas_kpa_mm3
    pneumatics.occluded = True
    pressure_after(0.1, pneumatics, FILL)
    pressure_after(1.0, pneumatics, LOCKED)
    apart_kpa = pneumatics.sensor_kpa
    pneumatics.occluded = False
    pressure = pressure_after(1.0, pneumatics, LOCKED)
    entered_kpa_mm3 = pneumatics.gas_kpa_mm3 - before_kpa_mm3
    assert apart_kpa == pytest.approx(8 + entered_kpa_mm3 / 12.68e3, abs=0.001)
    assert pneumatics.sensor_kpa == pytest.approx(pressure, abs=0.001)
    assert pressure == pytest.approx(8 + entered_kpa_mm3 / 28_000, abs=0.01)


def test_occluding_and_opening_the_tube_does_not_change_the_pressure():
    pneumatics = circuit(8.0)
    pneumatics.balloon_temperature.target_k = 15.0
    before = pressure_after(5.0, pneumatics, LOCKED)
    pneumatics.occluded = True
    assert pressure_after(DT_S, pneumatics, LOCKED) == pytest.approx(before, abs=1e-3)
    pneumatics.occluded = False
    assert pressure_after(DT_S, pneumatics, LOCKED) == pytest.approx(before, abs=1e-3)


@pytest.mark.parametrize(("part", "warmer_k", "rise_kpa"), [("balloon", 15, 0.450), ("circuit", 2, 0.332)])
def test_warming_raises_the_locked_pressure(part, warmer_k, rise_kpa):
    """The expected values follow from the gas law, for the paper's balloon and tubes at 8 kPa."""
    pneumatics = circuit(8.0, balloon_warming_s=0.2, circuit_warming_s=0.2)
    getattr(pneumatics, f"{part}_temperature").target_k = warmer_k
    assert pressure_after(4.0, pneumatics, LOCKED) - 8 == pytest.approx(rise_kpa, abs=0.005)


def test_after_fast_filling_the_gas_cools_and_the_locked_pressure_falls():
    pneumatics = circuit(5.0, polytropic=1.4)
    filled = pressure_after(0.5, pneumatics, FILL)
    assert 0.05 < filled - pressure_after(2.0, pneumatics, LOCKED) < 0.3


def test_creep_increases_the_volume_and_lowers_the_pressure():
    pneumatics = circuit(8.0, creep=0.01, creep_s=1.0)
    fall = 8.0 - pressure_after(8.0, pneumatics, LOCKED)
    assert pneumatics.creep.growth == pytest.approx(0.01 * (8 - fall) / 8, rel=0.01)
    assert fall == pytest.approx(109.3 * 0.01 * 2343 / 28_000, rel=0.05)


def test_a_rising_ambient_pressure_lowers_the_locked_gauge_pressure():
    pneumatics = circuit(8.0, ambient_drift_kpa_per_s=0.1)
    pressure = pressure_after(10.0, pneumatics, LOCKED)
    assert pneumatics.ambient.kpa == pytest.approx(102.325)
    assert -0.7 < pressure - 8 < -0.4
    assert pneumatics.sensor_kpa == pytest.approx(pressure, abs=0.01)


def test_the_ambient_pressure_swings_around_its_start_value():
    pneumatics = circuit(8.0, ambient_swing_kpa=0.5, ambient_swing_s=4.0)
    changes_kpa = []
    for _ in range(2000):
        pneumatics.ambient.step(DT_S)
        changes_kpa.append(pneumatics.ambient.kpa - 101.325)
    assert max(changes_kpa) == pytest.approx(0.5, abs=0.01)
    assert min(changes_kpa) == pytest.approx(-0.5, abs=0.01)


def test_during_insufflation_the_sensor_reads_the_sum_of_balloon_and_cavity_pressure():
    pneumatics = circuit(8.0, reference_kpa=1.6)
    pressure = pressure_after(1.0, pneumatics, LOCKED)
    assert pressure == pytest.approx(8.0)
    assert pneumatics.sensor_kpa == pytest.approx(9.6, abs=0.01)


@pytest.mark.parametrize("reference_kpa", [1.6, 5.0])
def test_a_vented_balloon_in_a_cavity_reaches_the_pressure_of_the_room(reference_kpa):
    pneumatics = circuit(8.0, reference_kpa=reference_kpa)
    assert pressure_after(4.0, pneumatics, SAFE) == pytest.approx(-reference_kpa, abs=0.01)
    assert pneumatics.sensor_kpa == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize(
    ("settings", "fact"),
    [
        ({"regulator_kpa": 80.0}, "regulator_kpa is 80, and must be from 0 to 50"),
        ({"polytropic": 0.9}, "polytropic is 0.9, and must be from 1 to 1.4"),
        ({"tube_time_constant_s": float("nan")}, "tube_time_constant_s is nan"),
        ({"tank_low_kpa": 700.0}, "tank_low_kpa must be below tank_high_kpa"),
    ],
)
def test_a_setting_outside_its_range_is_rejected(settings, fact):
    with pytest.raises(ValueError, match=fact):
        PneumaticSettings(**settings)


def test_a_leak_of_the_shut_inlet_raises_the_pressure_as_configured():
    pneumatics = circuit(8.0)
    pneumatics.inlet_leak_kpa_per_s = 0.02
    assert pressure_after(10, pneumatics, LOCKED) - 8.0 == pytest.approx(0.2, rel=0.1)


def test_without_supply_the_inlet_does_not_leak():
    pneumatics = circuit(8.0)
    pneumatics.inlet_leak_kpa_per_s, pneumatics.supply.shut = 0.02, True
    assert pressure_after(1, pneumatics, LOCKED) == pytest.approx(8.0, abs=1e-3)
