import pytest

from sim.pneumatics.settings import PneumaticSettings
from sim.pneumatics.supply import Supply


def supply(**settings):
    return Supply(PneumaticSettings(**settings))


def test_the_compressor_keeps_the_tank_between_its_limits():
    own = supply(tank_leak_kpa_per_s=5.0)
    seen = []
    for _ in range(20_000):
        own.step(0.0, 0.05)
        seen.append(own.tank_kpa)
    assert 399 < min(seen) < 401
    assert 599 < max(seen) < 601


def test_gas_that_is_taken_is_missing_in_the_tank():
    own = supply(tank_leak_kpa_per_s=0.0)
    for _ in range(500):
        own.step(150_000.0, 0.002)
    assert 600 - own.tank_kpa == pytest.approx(150_000 / 3e6, rel=1e-6)


def test_the_regulated_pressure_droops_under_flow_and_feels_the_tank():
    own = supply()
    own.tank_kpa = 500.0
    assert own.outlet_kpa == 50
    own.step(100_000.0, 1e-9)
    assert own.outlet_kpa == pytest.approx(50 - 1.0)
    own.step(0.0, 1e-9)
    own.tank_kpa = 600.0
    assert own.outlet_kpa == pytest.approx(50 - 0.5)


def test_without_a_compressor_the_tank_runs_empty_and_gives_what_it_has():
    own = supply(tank_leak_kpa_per_s=1.0)
    own.compressor_works = False
    for _ in range(580):
        own.step(0.0, 1.0)
    assert own.outlet_kpa == own.tank_kpa == pytest.approx(20, abs=1e-6)
    for _ in range(50):
        own.step(0.0, 1.0)
    assert own.outlet_kpa == 0
