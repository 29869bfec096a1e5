import pytest

from pneuforce.sim.pneumatics.settings import PneumaticSettings
from pneuforce.sim.pneumatics.supply import Supply


def supply(**settings):
    return Supply(PneumaticSettings(**settings))


def test_the_compressor_keeps_the_tank_between_its_limits():
    gas_supply = supply(tank_leak_kpa_per_s=5.0)
    pressures_kpa = []
    for _ in range(20_000):
        gas_supply.step(0.0, 0.05)
        pressures_kpa.append(gas_supply.tank_kpa)
    assert 399 < min(pressures_kpa) < 401
    assert 599 < max(pressures_kpa) < 601


def test_the_tank_pressure_falls_by_the_delivered_gas():
    gas_supply = supply(tank_leak_kpa_per_s=0.0)
    for _ in range(500):
        gas_supply.step(150_000.0, 0.002)
    assert 600 - gas_supply.tank_kpa == pytest.approx(150_000 / 3e6, rel=1e-6)


def test_the_regulated_pressure_falls_with_the_flow_and_with_a_rising_tank_pressure():
    gas_supply = supply()
    gas_supply.tank_kpa = 500.0
    assert gas_supply.outlet_kpa == 50
    gas_supply.step(100_000.0, 1e-9)
    assert gas_supply.outlet_kpa == pytest.approx(50 - 1.0)
    gas_supply.step(0.0, 1e-9)
    gas_supply.tank_kpa = 600.0
    assert gas_supply.outlet_kpa == pytest.approx(50 - 0.5)


def test_without_a_compressor_the_outlet_follows_the_tank_until_it_is_empty():
    gas_supply = supply(tank_leak_kpa_per_s=1.0)
    gas_supply.compressor_works = False
    for _ in range(580):
        gas_supply.step(0.0, 1.0)
    assert gas_supply.outlet_kpa == gas_supply.tank_kpa == pytest.approx(20, abs=1e-6)
    for _ in range(50):
        gas_supply.step(0.0, 1.0)
    assert gas_supply.outlet_kpa == 0
