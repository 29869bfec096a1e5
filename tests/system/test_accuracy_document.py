"""Tests that docs/accuracy.md is the output of `pneuforce accuracy`. Its numbers are not compared."""

import re
from pathlib import Path

from pneuforce.instrument.studies.accuracy_document import (
    CLOSING,
    TITLES,
    AccuracyCampaign,
    BalloonAccuracy,
    document,
    rejected_calibrations,
)
from pneuforce.instrument.studies.accuracy_study import CALIBRATED, UNCALIBRATED
from pneuforce.instrument.studies.population_study import ESTIMATORS, PopulationScores
from pneuforce.instrument.studies.timed_membrane import RigScore
from pneuforce.instrument.validation.accuracy import AccuracyScore, EstimatorScores

ROOT = Path(__file__).parents[2]
DOCUMENT = (ROOT / "docs/accuracy.md").read_text(encoding="utf-8")
COMMAND = re.compile(r"--contacts (\d+) --calibrations (\d+) --seed (\d+) --balloons (\d+)")
OTHER_FIGURES = re.compile(
    r"(?m)(all )?\d+ contacts|^\| \d+ %|\| \d+\.\d %|\d\.\d\d % of the time|"
    r"\d+\.\d\s%\sof\sthe\scontacts|calibrations:[^.]*\."
)
FIGURES = re.compile(r"\d+(\.\d+)? % · \d\.\d{3} N · \d+ %")


def test_the_document_is_the_output_for_the_campaign_that_it_names():
    campaign = AccuracyCampaign(*map(int, COMMAND.search(DOCUMENT).groups()))
    score = AccuracyScore(1.0, 0.1, 95.0)
    estimators = [EstimatorScores(name, score, (score,) * 5) for name in (*UNCALIBRATED, *CALIBRATED)]
    result = BalloonAccuracy(campaign.contacts, estimators, {})
    population = PopulationScores(
        campaign.balloons,
        1,
        [EstimatorScores(name, score, (score,) * 5, score) for name in ESTIMATORS],
        dict.fromkeys(ESTIMATORS, 0),
        dict.fromkeys(ESTIMATORS, 0),
    )
    timed = RigScore(campaign.calibrations, 1, score, 98.0, 0.1)
    generated = "\n".join(document(campaign, population, dict.fromkeys(TITLES, result), timed)) + "\n"
    assert DOCUMENT.endswith(CLOSING + "\n")

    def without_figures(text):
        text = re.sub(r"(?m)^Rejected calibrations:.*$", "", FIGURES.sub("#", text))
        return OTHER_FIGURES.sub("#", text)

    assert without_figures(DOCUMENT) == without_figures(generated)


def test_rejected_calibrations_are_listed_by_estimator():
    sentence = rejected_calibrations({"one": 2, "other": 0}, 8)
    assert "2 of 8 (one), 0 of 8 (other)" in sentence


def test_the_figures_of_the_other_documents_are_those_of_the_table():
    """The texts name the mean error from 1 to 3.5 N and the RMSE below 1 N, rounded."""
    table = DOCUMENT.partition("## A population")[2].partition("## Two balloons")[0]
    figures = re.findall(r"^\| ([^|]+) \| ([\d.]+) % · ([\d.]+) N ·", table, re.MULTILINE)
    percent = {name: f"{float(mean):.0f} %" for name, mean, _ in figures}
    rmse = {name: f"{float(newtons):.2f} N" for name, _, newtons in figures}
    names = ("energetic", "energetic, force sensor", "membrane, radius", "membrane, radius, one weight")
    model, readme = (
        " ".join((ROOT / name).read_text("utf-8").split()) for name in ("docs/model.md", "README.md")
    )
    for values in (percent, rmse):
        plain, force, radius, weight = (values[name] for name in names)
        cells = (
            f"{plain}; {force} after `calibrate force` | {radius} after `calibrate radius`; {weight} after"
        )
        assert cells in model
    assert f"is {percent[names[0]]} without calibration, {percent[names[2]]} with the method" in readme
    assert f"and {percent[names[3]]} after one known weight" in readme
