"""Tests of the heat of the gas: in fast contacts, and after a release that cools it (n = 1.2)."""

import math

import pytest

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.gas_heat import MAX_COOLING_RATIO, GasHeat
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import Scenario

DT_S = 0.002
RECOVERED_S = 1.0  #: time after a release in which the gas has become warm again


def measured(contacts):
    """Return the measurements at ΔP_i = 5.3 kPa while the balloon is held, with the true values."""
    scenario = Scenario(
        doc="cold gas", pneumatics={"polytropic": 1.2}, phase=[{"setpoint_kpa": [5.3], "contact": contacts}]
    )
    pairs = measure_playback(Playback(scenario), ChainSettings())
    return [(m, truth) for m, truth in pairs if math.isfinite(m.baseline_kpa)]


def press(force_n, pause_s):
    return {"kind": "press", "force_n": force_n, "rise_s": 0.2, "hold_s": 1.2, "pause_s": pause_s}


@pytest.fixture(scope="module")
def separate():
    return measured([press([3.4, 0.6], 1.8)])


@pytest.fixture(scope="module")
def quick():
    return measured([press([3.4], 0.15), press([0.6], 1.0)])


def test_the_recovery_of_the_pressure_is_no_contact(separate):
    assert separate[-1][0].in_contact is False
    shown_n = [m.force_n for m, truth in separate if truth.force_n == 0.0 and not m.in_contact]
    assert set(shown_n) == {0.0}
    contact_time_s = sum(DT_S for m, truth in separate if truth.force_n == 0.0 and m.in_contact)
    assert contact_time_s < 0.3  # the lag of the sensor


def test_the_pressure_before_the_next_contact_is_right(separate):
    light = [(m, truth) for m, truth in separate if truth.force_n == 0.6 and m.in_contact]
    true_kpa = next(truth.baseline_kpa for truth in (t for m, t in separate) if truth.force_n == 0.0)
    assert light[-1][0].baseline_kpa == pytest.approx(true_kpa, abs=0.01)
    assert light[-1][0].force_n == pytest.approx(0.6, abs=0.05)


def test_a_quick_second_contact_is_measured_within_its_uncertainty(quick):
    second = [m for m, truth in quick if truth.force_n == 0.6 and m.in_contact]
    assert len(second) * DT_S > 1.0
    assert all(abs(m.force_n - 0.6) <= 2 * m.force_std_n for m in second[100:])


def test_while_the_gas_is_cold_the_uncertainty_of_a_force_of_0_n_is_larger(separate):
    released_s = max(truth.t_s for m, truth in separate if truth.force_n > 3.0)
    free = [(truth.t_s - released_s, m.force_std_n) for m, truth in separate if m.force_n == 0.0]
    soon_n = [std_n for t_s, std_n in free if 0.3 < t_s < 0.4]
    later_n = [std_n for t_s, std_n in free if RECOVERED_S + 0.3 < t_s < 1.8]
    assert min(soon_n) > 2 * max(later_n)


def test_a_release_can_cool_the_gas_by_a_share_of_its_pressure_change_only():
    gas = GasHeat()
    for pressure_kpa in [9.0] * 1000 + [8.0] * 2:
        gas.step(pressure_kpa, DT_S)
    assert gas.dip_kpa == pytest.approx(MAX_COOLING_RATIO, rel=0.02)
    for _ in range(round(RECOVERED_S / DT_S)):
        gas.step(8.0, DT_S)
    assert gas.dip_kpa < 0.01


@pytest.mark.parametrize("steps", [[8.0] * 100 + [9.0] * 100, [9.0] * 100 + [math.nan] + [8.0] * 100])
def test_a_press_and_a_restart_are_no_release(steps):
    gas = GasHeat()
    for pressure_kpa in steps:
        gas.step(pressure_kpa, DT_S)
    assert gas.dip_kpa == 0.0


@pytest.mark.parametrize(("contact_s", "share"), [(0.0, 1.0), (0.3, 0.37), (1.0, 0.04), (5.0, 0.0)])
def test_the_heat_of_a_sudden_contact_fades(contact_s, share):
    gas = GasHeat()
    for pressure_kpa in [8.0] * 1000 + [9.0] * (1 + round(contact_s / DT_S)):
        gas.step(pressure_kpa, DT_S)
    assert gas.warm_share(8.0) == pytest.approx(share, abs=0.01)


def test_a_slow_contact_loses_its_heat_while_it_rises():
    gas = GasHeat()
    for n in range(5000):
        gas.step(8.0 + n / 5000, DT_S)
    assert gas.warm_share(8.0) == pytest.approx(0.03, abs=0.005)


def test_gas_that_is_at_rest_or_cold_or_unknown_has_no_heat_of_a_contact():
    gas = GasHeat()
    assert gas.warm_share(8.0) == 0.0
    for pressure_kpa in [9.0] * 1000:
        gas.step(pressure_kpa, DT_S)
    assert gas.warm_share(8.0) == pytest.approx(0.0)
    for pressure_kpa in [8.5] * 20:
        gas.step(pressure_kpa, DT_S)
    assert gas.warm_share(8.0) == 0.0
    gas.step(math.nan, DT_S)
    assert gas.warm_share(8.0) == gas.dip_kpa == 0.0


def test_warm_gas_above_a_baseline_that_is_higher_is_all_heat():
    gas = GasHeat()
    for pressure_kpa in [8.0] * 1000 + [8.5] * 5:
        gas.step(pressure_kpa, DT_S)
    assert gas.warm_share(9.0) == 1.0
