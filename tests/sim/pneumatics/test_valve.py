import pytest

from sim.pneumatics.flow import Orifice
from sim.pneumatics.valve import SolenoidValve

DT_S = 0.002


def course(valve, told):
    """Whether the valve is open after each step."""
    seen = []
    for told_open in told:
        valve.step(told_open, DT_S)
        seen.append(valve.open)
    return seen


def valve(opening_s=0.012, closing_s=0.02):
    return SolenoidValve(Orifice(10.0, 0.3), opening_s, closing_s, told_open=False)


def test_it_opens_and_closes_late_each_in_its_own_time():
    seen = course(valve(), [True] * 20 + [False] * 20)
    assert seen.index(True) * DT_S == pytest.approx(0.012, abs=DT_S)
    assert seen.index(False, 20) * DT_S == pytest.approx(0.04 + 0.02, abs=DT_S)


def test_a_pulse_that_is_shorter_than_its_delay_is_delayed_whole():
    seen = course(valve(closing_s=0.012), [True, True] + [False] * 20)
    assert sum(seen) == 2


def test_a_pulse_that_ends_while_the_valve_has_not_begun_to_move_is_lost():
    assert not any(course(valve(opening_s=0.02, closing_s=0.004), [True, True] + [False] * 20))


@pytest.mark.parametrize("stuck", [True, False])
def test_stuck_it_is_deaf_and_freed_it_is_where_it_was_told_to_be(stuck):
    own = valve()
    own.stuck = stuck
    assert set(course(own, [True] * 20 + [False] * 20 + [True] * 20)) == {stuck}
    own.stuck = None
    assert own.open
