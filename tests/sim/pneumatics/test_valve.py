import pytest

from pneuforce.sim.pneumatics.flow import Orifice
from pneuforce.sim.pneumatics.valve import SolenoidValve

DT_S = 0.002


def positions(valve, commands):
    """Return a list with an item for each step: True if the valve is open after the step."""
    opened = []
    for commanded_open in commands:
        valve.step(commanded_open, DT_S)
        opened.append(valve.open)
    return opened


def valve(opening_s=0.012, closing_s=0.02):
    return SolenoidValve(Orifice(10.0, 0.3), opening_s, closing_s, commanded_open=False)


def test_opening_and_closing_have_their_own_delays():
    opened = positions(valve(), [True] * 20 + [False] * 20)
    assert opened.index(True) * DT_S == pytest.approx(0.012, abs=DT_S)
    assert opened.index(False, 20) * DT_S == pytest.approx(0.04 + 0.02, abs=DT_S)


def test_a_pulse_that_is_shorter_than_its_delay_keeps_its_length():
    opened = positions(valve(closing_s=0.012), [True, True] + [False] * 20)
    assert sum(opened) == 2


def test_a_pulse_that_ends_before_the_valve_moves_is_lost():
    assert not any(positions(valve(opening_s=0.02, closing_s=0.004), [True, True] + [False] * 20))


@pytest.mark.parametrize("stuck", [True, False])
def test_a_stuck_valve_ignores_commands_and_a_freed_valve_has_the_commanded_position(stuck):
    solenoid = valve()
    solenoid.stuck = stuck
    assert set(positions(solenoid, [True] * 20 + [False] * 20 + [True] * 20)) == {stuck}
    solenoid.stuck = None
    assert solenoid.open
