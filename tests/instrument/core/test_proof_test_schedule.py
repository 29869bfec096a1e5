"""Schedule of the proof tests: first test, period, repetition, overdue test."""

import pytest

from pneuforce.instrument.core.proof_test_schedule import ProofTestSchedule, log_proof_test
from pneuforce.instrument.measurement.proof_test import Verdict

PERIOD_S = 60.0


class Clock:
    """Schedule in virtual time. A test starts as soon as it is due, and has the given verdicts in turn."""

    def __init__(self, *verdicts, setpoint_pa=8000):
        self.schedule, self.verdicts, self.setpoint_pa = ProofTestSchedule(), list(verdicts), setpoint_pa
        self.now_s = 0.0
        self.tests_s, self.blocked = [], []

    def run(self, seconds, free=True, allowed=True):
        for _ in range(round(seconds / 0.1)):
            self.now_s += 0.1
            self.schedule.step(self.setpoint_pa, free, not free, 0.1)
            if self.schedule.due and allowed:
                self.tests_s.append(round(self.now_s, 1))
                self.schedule.request(PERIOD_S)
                verdict = self.verdicts.pop(0) if self.verdicts else Verdict.PASSED
                self.blocked.append(self.schedule.finish(verdict, PERIOD_S))
        return self


def test_the_first_test_follows_ten_seconds_after_a_new_setpoint_and_the_next_after_a_period():
    assert Clock().run(200).tests_s == pytest.approx([10.0, 70.0, 130.0, 190.0], abs=0.2)


def test_each_request_changes_the_count_that_the_board_compares():
    schedule = ProofTestSchedule()
    counts = []
    for _ in range(3):
        schedule.request(PERIOD_S)
        counts.append(schedule.count)
    assert counts == [1, 2, 3]


def test_the_age_begins_with_a_passed_test():
    clock = Clock(Verdict.PASSED)
    while not clock.tests_s:
        clock.run(0.1)
    assert clock.schedule.age_s == 0.0


def test_a_failed_test_is_repeated_as_soon_as_the_balloon_was_free_for_two_seconds():
    assert Clock(Verdict.OCCLUDED).run(13).tests_s == pytest.approx([10.0, 12.0], abs=0.15)


@pytest.mark.parametrize(
    ("verdict", "lines"),
    [
        (Verdict.PASSED, []),
        (Verdict.INCONCLUSIVE, ["proof test inconclusive (response 1.50): it is repeated"]),
        (Verdict.OCCLUDED, ["proof test failed: the pressure changed 1.5 times as much as expected"]),
    ],
)
def test_the_log_names_a_test_that_has_not_passed(verdict, lines, caplog):
    with caplog.at_level("INFO"):
        log_proof_test(verdict, 1.5)
    assert caplog.messages == lines


def test_a_contact_postpones_the_test_until_the_balloon_was_free_for_two_seconds():
    clock = Clock().run(30).run(100, free=False).run(10)
    assert clock.tests_s == pytest.approx([10.0, 132.0], abs=0.2)


def test_contacts_with_short_pauses_postpone_the_test():
    clock = Clock().run(11)
    for _ in range(100):
        clock.run(1.0, free=False).run(1.5)
    assert len(clock.tests_s) == 1


def test_a_forbidden_test_follows_at_once_when_it_is_allowed_again():
    assert Clock().run(100, allowed=False).run(1).tests_s == pytest.approx([100.1])


def test_an_inconclusive_test_is_repeated_once_after_ten_seconds():
    clock = Clock(*[Verdict.INCONCLUSIVE] * 9).run(155)
    assert clock.tests_s == pytest.approx([10, 20, 80, 90, 150], abs=0.5)


def test_a_new_setpoint_is_tested_at_once():
    clock = Clock().run(15)
    clock.setpoint_pa = 9000
    assert clock.run(15).tests_s == pytest.approx([10.0, 25.0], abs=0.2)


def test_a_failed_test_is_repeated_at_once_and_two_failed_tests_show_a_blocked_tube():
    clock = Clock(Verdict.OCCLUDED, Verdict.OCCLUDED).run(13)
    assert clock.tests_s == pytest.approx([10.0, 12.1], abs=0.2)
    assert clock.blocked == [False, True]


@pytest.mark.parametrize("second", [Verdict.PASSED, Verdict.INCONCLUSIVE])
def test_another_verdict_refutes_a_failed_test(second):
    clock = Clock(Verdict.OCCLUDED, second, Verdict.OCCLUDED, Verdict.PASSED).run(100)
    assert clock.blocked == [False] * len(clock.blocked)
    assert not clock.schedule.suspected


def test_a_contact_refutes_a_failed_test():
    clock = Clock(Verdict.OCCLUDED).run(10.5)
    assert clock.schedule.suspected
    assert not clock.run(0.1, free=False).schedule.suspected


def test_a_test_is_overdue_after_ten_periods_without_a_pass():
    clock = Clock().run(11).run(598, free=False)
    assert not clock.schedule.overdue(PERIOD_S)
    assert clock.run(5, free=False).schedule.overdue(PERIOD_S)
    assert not clock.run(5).schedule.overdue(PERIOD_S)


def test_inconclusive_tests_become_overdue():
    assert Clock(*[Verdict.INCONCLUSIVE] * 99).run(610).schedule.overdue(PERIOD_S)


def test_a_held_balloon_without_tests_is_overdue_and_a_vented_one_is_not():
    assert Clock().run(1).schedule.overdue(0.0)
    assert not Clock(setpoint_pa=0).run(1000, free=False).schedule.overdue(0.0)
