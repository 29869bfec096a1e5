"""Schedule of the proof tests: when the next test may start, and whether a test is overdue."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

from pneuforce.instrument.measurement.proof_test import Verdict

log = logging.getLogger("pneuforce")

FREE_S = 2.0  #: time without contact before a test
FIRST_S = 10.0  #: time from a new setpoint to its first test
RETRY_S = 10.0  #: time until the repetition of a test that was inconclusive
#: A peer that forbids the tests must write at least once in this number of periods, or its value expires.
MAX_FORBIDDEN_PERIODS = 20.0
MAX_PERIODS = 10.0  #: a test is overdue if none has passed for this number of periods


@dataclass(slots=True)
class ProofTestSchedule:
    """Schedule of the tests at one setpoint."""

    count: int = 0  #: number of requested tests; a change starts a test on the board
    #: Time since a test has passed, or since the setpoint has changed; infinite if there is no setpoint.
    age_s: float = math.inf
    _setpoint_pa: int = 0
    _wait_s: float = 0.0  # time until the next test is due
    _free_s: float = 0.0  # time without contact
    _retried: bool = False  # the last test was the repetition of an inconclusive test
    #: The tube was found blocked, and since then neither a test has passed nor was the balloon replaced.
    tube_unproven: bool = False
    suspected: bool = False  #: the last test failed, and the test that confirms or refutes it has not ended

    def step(self, setpoint_pa: int, free: bool, in_contact: bool, dt_s: float) -> None:
        """Process one sample. `free` is True if the balloon is locked and without contact.

        A contact that is detected refutes a failed test: the sensor sees the balloon.
        """
        if setpoint_pa != self._setpoint_pa:
            self._setpoint_pa = setpoint_pa
            self.age_s = 0.0 if setpoint_pa else math.inf
            self._wait_s, self._free_s = FIRST_S, 0.0
            self._retried = self.suspected = False
        self.age_s += dt_s
        self._wait_s -= dt_s
        self._free_s = self._free_s + dt_s if free else 0.0
        self.suspected = self.suspected and not in_contact

    @property
    def due(self) -> bool:
        """Return True if a test is due, and the balloon has been free for some time."""
        return self._free_s >= FREE_S and self._wait_s <= 0.0

    def expedite(self) -> None:
        """Make a test due as soon as the balloon has been free for `FREE_S`."""
        self._wait_s = 0.0

    def request(self, period_s: float) -> None:
        """Request a test."""
        self.count += 1
        self._wait_s, self._free_s = period_s, 0.0

    def finish(self, verdict: Verdict, period_s: float) -> bool:
        """Process the verdict of a test. Return True if the tube is blocked: two tests in a row have failed.

        A failed test is repeated as soon as possible, because a short touch at the wrong moment has the same
        effect. An inconclusive test is repeated once before the next period.
        """
        blocked = self.suspected and verdict is Verdict.OCCLUDED
        self.suspected = verdict is Verdict.OCCLUDED
        self._retried = verdict is Verdict.INCONCLUSIVE and not self._retried
        if verdict is Verdict.PASSED:
            self.age_s, self.tube_unproven = 0.0, False
        elif self.suspected:
            self._wait_s = 0.0
        elif self._retried:
            self._wait_s = min(RETRY_S, period_s)
        return blocked

    def overdue(self, period_s: float) -> bool:
        """Return True if no test has passed for ten periods. Without tests, a held balloon is overdue."""
        return math.isfinite(self.age_s) and not self.age_s <= MAX_PERIODS * period_s


def oldest_forbidding_s(now_s: float, period_s: float) -> float:
    """Return the time of the oldest write that keeps the tests forbidden. Without a period, none expires."""
    return now_s - MAX_FORBIDDEN_PERIODS * period_s if period_s else -math.inf


def log_proof_test(verdict: Verdict, ratio: float) -> None:
    """Log the verdict of a test that has not passed. `ratio` is the response / the expected response."""
    if verdict is Verdict.INCONCLUSIVE:
        log.info("proof test inconclusive (response %.2f): it is repeated", ratio)
    elif verdict is Verdict.OCCLUDED:
        log.warning("proof test failed: the pressure changed %.1f times as much as expected", ratio)
