"""A check: one question about a rig, its answer, and what to do about it."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

AGAIN = "run it again"  #: what to do about a check that was disturbed


class Verdict(StrEnum):
    """How a check went."""

    GOOD = "good"
    DOUBTFUL = "doubtful"  #: works, but will trouble somebody
    BAD = "bad"
    NOT_CHECKED = "not checked"


class Check(NamedTuple):
    """One question about a rig, answered."""

    name: str
    verdict: Verdict
    found: str  #: what was seen, with its unit
    advice: str = ""  #: what to do, where the verdict is not good


def graded(name: str, found: str, advice: str, *, good: bool, usable: bool) -> Check:
    """A check by two conditions that state what is allowed: neither met is bad, so NaN is."""
    verdict = Verdict.GOOD if good else Verdict.DOUBTFUL if usable else Verdict.BAD
    return Check(name, verdict, found, "" if good else advice)


def unchecked(name: str, why: str, advice: str = "") -> Check:
    """A check that could not be made."""
    return Check(name, Verdict.NOT_CHECKED, why, advice)
