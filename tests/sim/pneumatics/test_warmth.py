import math

import pytest

from sim.pneumatics.warmth import COUNTED_AT_K, Compression, Warmth


def test_gas_takes_on_the_temperature_around_it_with_its_time_constant():
    own = Warmth(time_s=20.0, target_k=15.0)
    for _ in range(10_000):
        own.step(0.002)
    assert own.now_k == pytest.approx(15 * (1 - math.exp(-1)), rel=1e-6)
    assert own.ratio == pytest.approx(1 + own.now_k / COUNTED_AT_K)


def test_quick_compression_heats_gas_as_the_polytropic_law_says():
    own = Compression(1.4, relaxation_s=1e5)
    for n in range(1001):
        own.step(101.0 + 0.02 * n, 0.002)
    assert own.ratio == pytest.approx((121 / 101) ** (0.4 / 1.4), rel=1e-6)


def test_the_walls_take_the_heat_back():
    own = Compression(1.4, relaxation_s=0.3)
    own.step(101.0, 0.002)
    own.step(121.0, 0.002)
    heat = own.heat
    for _ in range(150):
        own.step(121.0, 0.002)
    assert own.heat == pytest.approx(heat / math.e, rel=1e-6)


def test_an_isothermal_gas_stays_as_warm_as_it_is():
    own = Compression(1.0, relaxation_s=0.3)
    own.step(101.0, 0.002)
    own.step(121.0, 0.002)
    assert own.ratio == 1
