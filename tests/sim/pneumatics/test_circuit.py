"""The paper's balloon at the end of the circuit."""

import pytest

from instrument.rig.frames import Valve
from sim.plant import amount_kpa_mm3
from sim.pneumatics import Pneumatics, PneumaticSettings
from sim.published import PublishedPlant

PLANT = PublishedPlant()
LOCKED, FILL = int(Valve.VENT_CLOSED), int(Valve.INLET_OPEN | Valve.VENT_CLOSED)
SAFE = int(Valve.NONE)
DT_S = 0.002


def circuit(start_kpa, **changed):
    """A tight locked one, unless it is changed."""
    settings = PneumaticSettings(**{"leak_kpa_per_s": 0.0, **changed})
    outside_kpa = settings.ambient_kpa + settings.reference_kpa
    amount = amount_kpa_mm3(PLANT, start_kpa, settings.tubes_mm3, outside_kpa)
    return Pneumatics(settings, amount, start_kpa + settings.reference_kpa, LOCKED)


def course(seconds, circuit, valves, force_n=0.0):
    """Pressures in the balloon, step by step."""
    seen = []
    for _ in range(round(seconds / DT_S)):
        circuit.step(PLANT.settle(circuit.gas, force_n), valves, DT_S)
        seen.append(PLANT.settle(circuit.gas, force_n).pressure_kpa)
    return seen


def pressure_after(seconds, circuit, valves):
    return course(seconds, circuit, valves)[-1]


@pytest.mark.parametrize("start_kpa", [3.0, 5.0, 8.0])
def test_the_inlet_inflates_at_4_to_7_kpa_per_second(start_kpa):
    rise = pressure_after(0.112, circuit(start_kpa), FILL) - start_kpa
    assert 4 <= rise / 0.1 <= 7


def test_the_vent_empties_the_balloon_in_two_seconds():
    assert pressure_after(2.0, circuit(12.0), SAFE) < 0.1


def test_both_valves_open_leave_less_than_5_kpa():
    assert 1 < pressure_after(10, circuit(8.0), int(Valve.INLET_OPEN)) < 5


def test_locked_it_leaks_as_configured():
    fall = 8.0 - pressure_after(10, circuit(8.0, leak_kpa_per_s=0.01), LOCKED)
    assert fall == pytest.approx(0.1, rel=0.1)


def test_a_valve_moves_12_ms_after_it_was_told_and_a_short_pulse_is_delayed_whole():
    own = circuit(8.0)
    told = [FILL, FILL] + [LOCKED] * 10
    open_at = []
    for n, valves in enumerate(told):
        course(DT_S, own, valves)
        open_at += [n] if own.inlet.open else []
    assert len(open_at) == 2
    assert open_at[0] * DT_S == pytest.approx(0.012, abs=DT_S)


def test_the_tube_lags_by_its_time_constant():
    own = circuit(10.0)
    own.sensor_kpa = 0.0
    pressure_after(0.06, own, LOCKED)
    assert own.sensor_kpa == pytest.approx(6.32, abs=0.01)


def test_tubes_of_twice_the_volume_fill_more_slowly():
    narrow, wide = (pressure_after(0.2, circuit(5.0, tubes_mm3=v), FILL) for v in (12.68e3, 25.36e3))
    assert wide - 5 < 0.8 * (narrow - 5)


def test_a_shut_supply_and_an_inlet_that_is_stuck_shut_let_nothing_in():
    shut, stuck = circuit(5.0), circuit(5.0)
    shut.supply.shut = True
    stuck.inlet.stuck = False
    assert pressure_after(0.5, shut, FILL) == pytest.approx(5)
    assert pressure_after(0.5, stuck, FILL) == pytest.approx(5)


def test_an_empty_tank_takes_no_gas_back():
    own = circuit(5.0)
    own.supply.tank_kpa, own.supply.compressor_works = 0.0, False
    assert pressure_after(0.5, own, FILL) == pytest.approx(5)


def test_a_vent_that_is_stuck_shut_empties_nothing():
    own = circuit(8.0)
    own.vent.stuck = False
    assert pressure_after(1.0, own, SAFE) == pytest.approx(8)


@pytest.mark.parametrize("occluded", [False, True])
def test_a_burst_balloon_loses_half_of_its_pressure_in_50_ms_and_stays_empty(occluded):
    own = circuit(8.0)
    own.burst, own.occluded = True, occluded
    pressures = course(0.5, own, LOCKED)
    assert pressures[25] < 4
    assert all(pressure > -1e-6 for pressure in pressures)
    assert pressures[-1] == pytest.approx(0, abs=0.01)


def test_behind_a_shut_tube_the_balloon_keeps_its_gas_and_the_sensor_sees_empty_tubes():
    own = circuit(8.0)
    own.occluded = True
    assert pressure_after(1.5, own, SAFE) == pytest.approx(8)
    assert own.sensor_kpa == pytest.approx(0, abs=0.01)


def test_a_tube_that_opens_again_shares_the_gas_of_both_sides():
    own = circuit(8.0)
    before_kpa_mm3 = own.gas_kpa_mm3
    own.occluded = True
    pressure_after(0.1, own, FILL)
    pressure_after(1.0, own, LOCKED)
    apart_kpa = own.sensor_kpa
    own.occluded = False
    pressure = pressure_after(1.0, own, LOCKED)
    entered_kpa_mm3 = own.gas_kpa_mm3 - before_kpa_mm3
    assert apart_kpa == pytest.approx(8 + entered_kpa_mm3 / 12.68e3, abs=0.001)
    assert own.sensor_kpa == pytest.approx(pressure, abs=0.001)
    assert pressure == pytest.approx(8 + entered_kpa_mm3 / 28_000, abs=0.01)


def test_shutting_and_opening_the_tube_changes_nothing_by_itself():
    own = circuit(8.0)
    own.balloon_warmth.target_k = 15.0
    before = pressure_after(5.0, own, LOCKED)
    own.occluded = True
    assert pressure_after(DT_S, own, LOCKED) == pytest.approx(before, abs=1e-3)
    own.occluded = False
    assert pressure_after(DT_S, own, LOCKED) == pytest.approx(before, abs=1e-3)


@pytest.mark.parametrize(("part", "warmer_k", "rise_kpa"), [("balloon", 15, 0.450), ("circuit", 2, 0.332)])
def test_warming_raises_the_locked_pressure(part, warmer_k, rise_kpa):
    """By the gas law, for the paper's balloon and tubes at 8 kPa."""
    own = circuit(8.0, balloon_warming_s=0.2, circuit_warming_s=0.2)
    getattr(own, f"{part}_warmth").target_k = warmer_k
    assert pressure_after(4.0, own, LOCKED) - 8 == pytest.approx(rise_kpa, abs=0.005)


def test_gas_that_was_filled_in_quickly_cools_and_the_locked_pressure_falls():
    own = circuit(5.0, polytropic=1.4)
    filled = pressure_after(0.5, own, FILL)
    assert 0.05 < filled - pressure_after(2.0, own, LOCKED) < 0.3


def test_creep_lets_the_volume_grow_and_the_pressure_fall():
    own = circuit(8.0, creep=0.01, creep_s=1.0)
    fall = 8.0 - pressure_after(8.0, own, LOCKED)
    assert own.creep.growth == pytest.approx(0.01 * (8 - fall) / 8, rel=0.01)
    assert fall == pytest.approx(109.3 * 0.01 * 2343 / 28_000, rel=0.05)


def test_a_rising_barometer_lowers_the_locked_gauge_pressure():
    own = circuit(8.0, ambient_drift_kpa_per_s=0.1)
    pressure = pressure_after(10.0, own, LOCKED)
    assert own.ambient.kpa == pytest.approx(102.325)
    assert -0.7 < pressure - 8 < -0.4
    assert own.sensor_kpa == pytest.approx(pressure, abs=0.01)


def test_the_barometer_swings_about_where_it_began():
    own = circuit(8.0, ambient_swing_kpa=0.5, ambient_swing_s=4.0)
    seen = []
    for _ in range(2000):
        own.ambient.step(DT_S)
        seen.append(own.ambient.kpa - 101.325)
    assert max(seen) == pytest.approx(0.5, abs=0.01)
    assert min(seen) == pytest.approx(-0.5, abs=0.01)


def test_under_insufflation_the_sensor_reads_balloon_and_cavity_together():
    own = circuit(8.0, reference_kpa=1.6)
    pressure = pressure_after(1.0, own, LOCKED)
    assert pressure == pytest.approx(8.0)
    assert own.sensor_kpa == pytest.approx(9.6, abs=0.01)


@pytest.mark.parametrize("reference_kpa", [1.6, 5.0])
def test_a_vented_balloon_in_a_cavity_gets_down_to_the_pressure_of_the_room(reference_kpa):
    own = circuit(8.0, reference_kpa=reference_kpa)
    assert pressure_after(4.0, own, SAFE) == pytest.approx(-reference_kpa, abs=0.01)
    assert own.sensor_kpa == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"regulator_kpa": 80.0}, "regulator_kpa is 80, and must be from 0 to 50"),
        ({"polytropic": 0.9}, "polytropic is 0.9, and must be from 1 to 1.4"),
        ({"tube_s": float("nan")}, "tube_s is nan"),
        ({"tank_low_kpa": 700.0}, "tank_low_kpa must be below tank_high_kpa"),
    ],
)
def test_a_circuit_that_nobody_could_build_is_refused_in_a_sentence(settings, sentence):
    with pytest.raises(ValueError, match=sentence):
        PneumaticSettings(**settings)
