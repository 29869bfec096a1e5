import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.sim.contacts.tissue import MAX_PUSH_N, HalfSpace, Rigid, Spring, force_at_travel

LIVER = HalfSpace(modulus_kpa=10.0, radius_mm=8.0)
tissues = st.one_of(
    st.just(Rigid()),
    st.builds(Spring, st.floats(0.01, 100)),
    st.builds(HalfSpace, st.floats(0.1, 1e4), st.floats(0.5, 100)),
)


def balloon_mm(force_n):
    """Return the indentation of a balloon that becomes stiffer with the force."""
    return 3 * math.log1p(force_n)


def test_the_half_space_follows_hertz():
    # F = 4/3 · E/(1 − ν²) · √R · δ^1.5 with E = 10 kPa, ν = 0.5, R = 8 mm, δ = 4 mm, in mN
    force_n = 4 / 3 * (10 / 0.75) * math.sqrt(8) * 8 * 1e-3
    assert LIVER.indentation_mm(force_n) == pytest.approx(4.0)


def test_a_spring_is_linear_and_a_wall_is_rigid():
    assert Spring(0.5).indentation_mm(2.0) == 4.0
    assert Rigid().indentation_mm(20.0) == 0.0


@given(st.floats(0.001, 20), tissues, st.floats(0, MAX_PUSH_N))
def test_at_the_force_of_a_travel_the_indentations_add_up_to_the_travel(travel_mm, tissue, near_n):
    force_n = force_at_travel(travel_mm, tissue, balloon_mm, near_n)
    reached_mm = balloon_mm(force_n) + tissue.indentation_mm(force_n)
    assert 0 <= force_n <= MAX_PUSH_N
    if reached_mm < travel_mm - 1e-5:
        assert force_n == pytest.approx(MAX_PUSH_N)
    else:
        assert reached_mm == pytest.approx(travel_mm, abs=1e-5)


@given(st.floats(-5, 0), tissues)
def test_a_travel_of_zero_or_less_gives_no_force(travel_mm, tissue):
    assert force_at_travel(travel_mm, tissue, balloon_mm) == 0.0


def test_softer_tissue_gives_less_force_at_the_same_travel():
    forces_n = [force_at_travel(4.0, HalfSpace(kpa, 8.0), balloon_mm) for kpa in (1, 10, 100, 1000)]
    assert forces_n == sorted(forces_n)
    assert forces_n[-1] < force_at_travel(4.0, Rigid(), balloon_mm)


def test_a_changing_travel_takes_less_than_6_evaluations_of_the_balloon_per_step():
    evaluations = 0

    def counted_mm(force_n):
        nonlocal evaluations
        evaluations += 1
        return balloon_mm(force_n)

    force_n = 0.0
    for n in range(500):
        force_n = force_at_travel(0.01 * n, LIVER, counted_mm, force_n)
    assert evaluations / 500 < 6
