import itertools
import math

import pytest

from pneuforce.sim.pneumatics.flow import Orifice

ORIFICE = Orifice(10.0, 0.3)


def test_choked_flow_depends_on_the_upstream_pressure_only():
    assert ORIFICE.flow(500.0, 101.0) == ORIFICE.flow(500.0, 10.0) == pytest.approx(100 * 10 * 500)


def test_subsonic_flow_follows_the_ellipse_of_iso_6358():
    share = math.sqrt(1 - ((0.7 - 0.3) / (1 - 0.3)) ** 2)
    assert ORIFICE.flow(150.0, 105.0) == pytest.approx(100 * 10 * 150 * share)


def test_the_flow_is_antisymmetric():
    assert ORIFICE.flow(101.0, 110.0) == -ORIFICE.flow(110.0, 101.0)


def test_the_flow_is_linear_at_small_drops_and_continuous_everywhere():
    assert ORIFICE.flow(101.0, 101.0) == 0
    assert ORIFICE.flow(101.0, 100.95) == pytest.approx(ORIFICE.flow(101.0, 100.9) / 2, rel=1e-9)
    flows = [ORIFICE.flow(100.0, 100.0 - drop_kpa / 100) for drop_kpa in range(10_000)]
    rises = [b - a for a, b in itertools.pairwise(flows)]
    assert min(rises) >= 0
    assert max(rises) == pytest.approx(rises[0])
