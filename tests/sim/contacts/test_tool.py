"""Tests of a tool that a robot moves: speed, acceleration, silence and force."""

import pytest

from pneuforce.sim.contacts.tissue import Rigid
from pneuforce.sim.contacts.tool import ACCELERATION_MM_PER_S2, SILENCE_S, TRAVEL_SPAN_MM, MovedTool
from pneuforce.sim.hand import Hand
from tests.sim.test_hand import DT_S, forces, soft


def run(tool, seconds, speed_mm_per_s):
    """Repeat the command in each step; return the forces."""
    forces_n = []
    for _ in range(round(seconds / DT_S)):
        tool.command(speed_mm_per_s)
        forces_n.append(tool.step(DT_S).force_n(soft))
    return forces_n


def test_there_is_no_force_before_the_tissue_and_then_a_force_that_follows_the_travel():
    tool = MovedTool(Rigid(), distance_mm=5.0)
    assert set(run(tool, 0.9, 5.0)) == {0.0}
    forces_n = run(tool, 1.0, 5.0)
    assert forces_n[-1] == pytest.approx(soft_force_n(tool.push.travel_mm))
    assert tool.push.travel_mm == pytest.approx(4.5, abs=0.1)


def soft_force_n(travel_mm):
    return travel_mm / soft(1.0)


def test_the_speed_changes_at_the_limited_rate():
    tool = MovedTool(Rigid(), distance_mm=50.0)
    run(tool, 0.01, 100.0)
    assert tool.speed_mm_per_s == pytest.approx(ACCELERATION_MM_PER_S2 * 0.01)
    run(tool, 0.3, 10.0)
    assert tool.speed_mm_per_s == 10.0


def test_the_robot_stops_without_commands():
    tool = MovedTool(Rigid(), distance_mm=50.0)
    run(tool, 0.1, 10.0)
    for _ in range(round((SILENCE_S + 0.1) / DT_S)):
        tool.step(DT_S)
    assert tool.speed_mm_per_s == 0.0


def test_the_travel_is_limited():
    tool = MovedTool(Rigid(), distance_mm=1.0)
    run(tool, 2.0, 100.0)
    assert tool.push.travel_mm == TRAVEL_SPAN_MM[1]


def test_a_robot_replaces_the_hand_until_the_release():
    hand = Hand(plays_phases=True)
    assert not hand.move(1.0)
    hand.give_to_robot(MovedTool(Rigid(), distance_mm=0.0))
    assert set(forces(hand, 3.0)) == {0.0}  # the hand would have pressed by now
    for _ in range(50):
        assert hand.move(10.0)
        pressed_n = forces(hand, 0.02)[-1]
    assert pressed_n > 1.0
    hand.release()
    released = forces(hand, 2.0)
    assert released[0] <= pressed_n
    assert 0.0 in released
    assert not hand.move(1.0)
