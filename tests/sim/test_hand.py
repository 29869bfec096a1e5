import itertools

import pytest

from pneuforce.sim.contacts.contact import Phase
from pneuforce.sim.hand import READY_S, Hand
from pneuforce.sim.scenario import contacts_of, load

DT_S = 0.002
PRESSES = contacts_of({"kind": "press", "force_n": [1.0, 2.0], "rise_s": 0.5, "hold_s": 0.5, "pause_s": 0.5})
TAP = {"kind": "tap", "force_n": 1.2, "pause_s": 0.0}


def soft(force_n):
    """Return the indentation [mm] of a balloon with a compliance of 2 mm/N."""
    return 2 * force_n


def forces(hand, seconds, held=True):
    return [hand.step(held, DT_S).force_n(soft) for _ in range(round(seconds / DT_S))]


def test_the_hand_waits_until_the_balloon_has_been_held_for_a_second():
    hand = Hand(plays_phases=True)
    assert max(forces(hand, 5, held=False)) == 0
    assert max(forces(hand, READY_S)) == 0
    assert max(forces(hand, 1.0)) > 1


def test_the_demo_repeats_plateaus_taps_and_overlapping_contacts():
    hand = Hand(plays_phases=True)
    forces_n = forces(hand, 120)
    highest_n = max(c.trajectory.at(t / 100) for c in load("demo").phases[0].contacts for t in range(500))
    assert max(forces_n[-15_000:]) == pytest.approx(highest_n)
    plateaus = [len(list(same)) * DT_S for force, same in itertools.groupby(forces_n) if force > 0]
    assert sum(length >= 1.5 for length in plateaus) >= 12
    pauses = [len(list(same)) * DT_S for force, same in itertools.groupby(forces_n) if force == 0]
    assert min(pauses) < 0.06


def test_no_force_of_the_demo_or_of_a_request_changes_faster_than_10_n_per_second():
    hand = Hand(plays_phases=True)
    forces_n = forces(hand, 60)
    hand.press(20)
    forces_n += forces(hand, 1)
    hand.release()
    forces_n += forces(hand, 1, held=False)
    hand.press(3)
    forces_n += forces(hand, 1)
    hand.play(contacts_of(TAP))
    forces_n += forces(hand, 3)
    assert max(abs(b - a) for a, b in itertools.pairwise(forces_n)) <= 10.001 * DT_S


def test_a_contact_ends_when_the_balloon_is_no_longer_held_and_is_repeated_later():
    hand = Hand(True, [Phase(8.0, PRESSES)], repeat=False)
    assert max(forces(hand, 2.0)) == 1.0
    assert forces(hand, 1, held=False)[-1] == 0
    assert max(forces(hand, 2.0)) == 1.0
    assert max(forces(hand, 3.0)) == 2.0


def test_a_contact_is_not_repeated_if_the_balloon_is_topped_up_in_the_pause_after_the_contact():
    hand = Hand(True, [Phase(8.0, PRESSES)], repeat=False)
    forces(hand, READY_S + 1.6)  # after the first contact, during its pause
    assert max(forces(hand, 0.2, held=False)) == 0
    assert max(forces(hand, READY_S + 1.0)) == 2.0


def test_phases_that_are_played_once_end_without_another_press():
    hand = Hand(True, [Phase(8.0, PRESSES)], repeat=False)
    assert not hand.finished
    forces_n = forces(hand, READY_S + 2 * 2.0 + 0.1)
    assert hand.finished
    assert max(forces_n) == 2.0
    assert max(forces(hand, 5)) == 0


def test_a_phase_at_another_setpoint_waits_until_the_balloon_is_held_again():
    hand = Hand(True, [Phase(8.0, PRESSES[:1]), Phase(6.0, PRESSES[1:])])
    forces(hand, READY_S + 1.9)
    assert hand.setpoint_kpa == 8.0
    assert max(forces(hand, 1.9)) == 0
    assert hand.setpoint_kpa == 6.0
    assert max(forces(hand, 3, held=False)) == 0
    assert max(forces(hand, READY_S)) == 0
    assert max(forces(hand, 2)) == 2.0
    assert hand.setpoint_kpa == 8.0


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("plays_phases", [True, False])
def test_a_requested_press_lasts_until_the_release(plays_phases, held):
    hand = Hand(plays_phases)
    hand.press(2.5)
    assert set(forces(hand, 3, held)[-500:]) == {2.5}
    hand.release()
    assert 0 in forces(hand, 1, held)


def test_the_phases_continue_after_a_release():
    hand = Hand(plays_phases=True)
    hand.press(1)
    forces(hand, 3)
    hand.release()
    assert max(forces(hand, 5)) > 1


@pytest.mark.parametrize("plays_phases", [True, False])
def test_a_requested_contact_is_played_once_at_any_time(plays_phases):
    hand = Hand(plays_phases, [Phase(8.0, PRESSES)])
    forces(hand, 2.0)
    hand.play(contacts_of(TAP))
    assert max(forces(hand, 1.0)) == pytest.approx(1.2)
    later_n = max(forces(hand, 5.0))
    assert later_n == (2.0 if plays_phases else 0.0)


def test_a_requested_press_starts_at_the_force_that_a_travel_has_reached():
    hand = Hand(False)
    hand.play(contacts_of({"kind": "hold", "travel_mm": 4.0}))
    assert forces(hand, 2.0)[-1] == pytest.approx(2.0, abs=1e-4)
    hand.press(3.0)
    forces_n = forces(hand, 1.0)
    assert forces_n[0] == pytest.approx(2.0, abs=0.02)
    assert forces_n[-1] == 3.0
