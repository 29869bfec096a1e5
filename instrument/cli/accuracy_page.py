"""The page docs/accuracy.md: what is printed before, in and after the tables of `pneuforce accuracy`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import NamedTuple

from instrument.fifths import EDGES_KPA
from instrument.validation.accuracy import Estimator, Score

CONTACTS_PER_CALIBRATION = 24
OPENING = """\
# Accuracy on the simulated balloons

Made by `pneuforce accuracy --contacts {contacts} --calibrations {calibrations} --seed {seed}`.

Plateaus of 0.2 to 3.5 N at setpoints of 5.05 to 11.35 kPa on the simulated rig, with the noise of its ADC,
its filter and its leak, through the instrument's own link and chain, as it is delivered; the truth is the
simulator's, read by a force cell with a noise of 0.01 N. Each cell: mean absolute error of the forces from
1 to 3.5 N · RMSE of the forces below 1 N · contacts whose truth lies within ±2u (a normal error: 95 %).

*Calibrated* is the average over {calibrations} calibrations by `pneuforce calibrate force`, each with
{points} contacts of its own, none of which is judged here. *Smooth* is the same with `low = "smooth"`.
A calibration that is refused, because it would gain nothing, counts as the bare law.
"""
TITLES = {
    "published": "The published balloon, which obeys the energetic law",
    "membrane": "The rubber balloon, which nobody fitted to the law",
}
CLOSING = """\
## How to read this

- On the `published` balloon the instrument is right by construction, but for the blend of the step between
  7.85 and 9.85 kPa, which that balloon does not have.
- On the rubber balloon the uncalibrated law errs by more than its stated uncertainty: that is the paper's
  error, for the paper's balloon. A calibration is what makes the number that of *your* balloon; then ±2u
  holds.
- Neither is your balloon. `pneuforce validate --data` and `pneuforce calibrate force` judge that, with a
  force cell."""


class Campaign(NamedTuple):
    """How much is simulated."""

    contacts: int
    calibrations: int
    seed: int


class Judged(NamedTuple):
    """What was found on one balloon."""

    contacts: int
    estimators: list[Estimator]
    refused: Mapping[str, int]  #: calibrations that were refused, by the estimator's name


def page(campaign: Campaign, judged: Mapping[str, Judged]) -> Iterator[str]:
    """The lines of the page."""
    yield opening(campaign)
    for plant, found in judged.items():
        yield f"## {TITLES[plant]} (`{plant}`)"
        yield ""
        yield from _table(found)
        yield ""
        yield refusals(found.refused, campaign.calibrations)
        yield ""
    yield CLOSING


def opening(campaign: Campaign) -> str:
    """All that stands before the tables."""
    return OPENING.format(**campaign._asdict(), points=CONTACTS_PER_CALIBRATION)


def refusals(refused: Mapping[str, int], calibrations: int) -> str:
    """How many calibrations count as the bare law."""
    each = ", ".join(f"{count} of {calibrations} ({name})" for name, count in refused.items())
    return f"Calibrations refused: {each}."


def _table(found: Judged) -> Iterator[str]:
    spans = [f"{low:.2f}–{high:.2f} kPa" for low, high in pairwise(EDGES_KPA)]
    yield "| " + " | ".join(["estimator", f"all {found.contacts} contacts", *spans]) + " |"
    yield "| --- " * (len(spans) + 2) + "|"
    for estimator in found.estimators:
        cells = [_cell(score) for score in (estimator.all, *estimator.by_pressure)]
        yield "| " + " | ".join([estimator.name, *cells]) + " |"


def _cell(score: Score) -> str:
    return f"{score.mean_percent:.1f} % · {score.rmse_n:.3f} N · {score.held_percent:.0f} %"
