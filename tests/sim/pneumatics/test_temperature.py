import math

import pytest

from pneuforce.sim.pneumatics.temperature import REFERENCE_TEMPERATURE_K, CompressionHeat, GasTemperature


def test_gas_approaches_the_ambient_temperature_with_its_time_constant():
    gas = GasTemperature(time_s=20.0, target_k=15.0)
    for _ in range(10_000):
        gas.step(0.002)
    assert gas.now_k == pytest.approx(15 * (1 - math.exp(-1)), rel=1e-6)
    assert gas.ratio == pytest.approx(1 + gas.now_k / REFERENCE_TEMPERATURE_K)


def test_fast_compression_heats_gas_by_the_polytropic_law():
    gas = CompressionHeat(1.4, relaxation_s=1e5)
    for n in range(1001):
        gas.step(101.0 + 0.02 * n, 0.002)
    assert gas.ratio == pytest.approx((121 / 101) ** (0.4 / 1.4), rel=1e-6)


def test_the_walls_absorb_the_heat():
    gas = CompressionHeat(1.4, relaxation_s=0.3)
    gas.step(101.0, 0.002)
    gas.step(121.0, 0.002)
    heat = gas.heat
    for _ in range(150):
        gas.step(121.0, 0.002)
    assert gas.heat == pytest.approx(heat / math.e, rel=1e-6)


def test_an_isothermal_gas_keeps_its_temperature():
    gas = CompressionHeat(1.0, relaxation_s=0.3)
    gas.step(101.0, 0.002)
    gas.step(121.0, 0.002)
    assert gas.ratio == 1
