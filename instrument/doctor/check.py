"""Result of one check of a rig, with the finding and the advice."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

RUN_AGAIN = "run pneuforce doctor again"  #: advice for a check that was disturbed


class CheckResult(StrEnum):
    """Result of a check."""

    PASS = "pass"
    WARNING = "warning"  #: the rig works, but a problem is likely later
    FAIL = "fail"
    NOT_CHECKED = "not checked"
    NOT_APPLICABLE = "not applicable"  #: the rig has no such part


class Check(NamedTuple):
    """One check of a rig."""

    name: str
    result: CheckResult
    finding: str  #: measured value with its unit, or observation
    advice: str = ""  #: recommended action; empty if the check has passed


def graded(name: str, finding: str, advice: str, *, passed: bool, usable: bool) -> Check:
    """Return a check: PASS if `passed`, WARNING if only `usable`, else FAIL.

    The caller writes both conditions so that they are false for NaN. A NaN then gives FAIL.
    """
    result = CheckResult.PASS if passed else CheckResult.WARNING if usable else CheckResult.FAIL
    return Check(name, result, finding, "" if passed else advice)


def unchecked(name: str, why: str, advice: str = "") -> Check:
    """Return a check that was not possible."""
    return Check(name, CheckResult.NOT_CHECKED, why, advice)


def inapplicable(name: str, why: str) -> Check:
    """Return a check of a part that this rig does not have."""
    return Check(name, CheckResult.NOT_APPLICABLE, why)
