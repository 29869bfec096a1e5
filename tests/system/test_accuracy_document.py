"""docs/accuracy.md is what `pneuforce accuracy` prints, but for figures that take minutes."""

import re
from pathlib import Path

from instrument.cli.accuracy_page import CLOSING, TITLES, Campaign, Judged, opening, page, refusals
from instrument.validation.accuracy import Estimator, Score

DOCUMENT = (Path(__file__).parents[2] / "docs/accuracy.md").read_text(encoding="utf-8")
MADE_BY = re.compile(r"--contacts (\d+) --calibrations (\d+) --seed (\d+)")
FIGURES = re.compile(r"\d+(\.\d+)? % · \d\.\d{3} N · \d+ %")


def test_the_document_is_the_page_of_the_campaign_that_it_names():
    campaign = Campaign(*map(int, MADE_BY.search(DOCUMENT).groups()))
    score = Score(1.0, 0.1, 95.0)
    names = ("energetic", "lulevich", "shanahan", "energetic, calibrated", "the same, smooth")
    found = Judged(campaign.contacts, [Estimator(name, score, (score,) * 5) for name in names], {})
    made = "\n".join(page(campaign, dict.fromkeys(TITLES, found))) + "\n"
    assert DOCUMENT.startswith(opening(campaign))
    assert DOCUMENT.endswith(CLOSING + "\n")

    def without_figures(text):
        return re.sub(r"(?m)^Calibrations refused:.*$", "", FIGURES.sub("#", text))

    assert without_figures(DOCUMENT) == without_figures(made)


def test_calibrations_that_were_refused_are_told_by_name():
    assert refusals({"one": 2, "other": 0}, 8) == "Calibrations refused: 2 of 8 (one), 0 of 8 (other)."
