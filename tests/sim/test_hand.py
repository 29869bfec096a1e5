import itertools

import pytest

from sim.hand import PRESSES, Hand

DT_S = 0.002


def forces(hand, seconds, held=True):
    return [hand.step(held, DT_S) for _ in range(round(seconds / DT_S))]


def test_the_hand_waits_until_the_balloon_was_held_for_a_second():
    hand = Hand(works=True)
    assert max(forces(hand, 5, held=False)) == 0
    assert max(forces(hand, 1.0)) == 0
    assert max(forces(hand, 1.0)) > 1


def test_contacts_come_for_ever_with_plateaus_taps_and_overlaps():
    hand = Hand(works=True)
    course = forces(hand, 120)
    assert max(course[-15_000:]) == max(press.force_n for press in PRESSES)
    plateaus = [len(list(same)) * DT_S for force, same in itertools.groupby(course) if force > 0]
    assert sum(length >= 1.5 for length in plateaus) >= 12
    pauses = [len(list(same)) * DT_S for force, same in itertools.groupby(course) if force == 0]
    assert min(pauses) < 0.06


def test_no_force_ever_changes_faster_than_10_n_per_second():
    hand = Hand(works=True)
    course = forces(hand, 60)
    hand.press(20)
    course += forces(hand, 1)
    hand.release()
    course += forces(hand, 1, held=False)
    assert max(abs(b - a) for a, b in itertools.pairwise(course)) <= 10.001 * DT_S


def test_a_balloon_that_is_no_longer_held_is_let_go():
    hand = Hand(works=True)
    forces(hand, 2.5)
    assert hand.force_n > 1
    assert forces(hand, 1, held=False)[-1] == 0


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("works", [True, False])
def test_a_press_by_command_is_held_until_released(works, held):
    hand = Hand(works)
    hand.press(2.5)
    assert set(forces(hand, 3, held)[-500:]) == {2.5}
    hand.release()
    assert 0 in forces(hand, 1, held)


def test_after_a_release_the_table_goes_on():
    hand = Hand(works=True)
    hand.press(1)
    forces(hand, 3)
    hand.release()
    assert max(forces(hand, 5)) > 1
