"""`pneuforce accuracy`, with few contacts."""

import json

import pytest

from instrument.cli.accuracy import accuracy
from instrument.cli.accuracy_page import Campaign


@pytest.fixture(scope="module")
def figures():
    return json.loads(accuracy(Campaign(contacts=45, calibrations=1, seed=1), as_json=True))


def test_each_estimator_is_judged_on_each_balloon(figures):
    for plant in ("published", "membrane"):
        assert figures[plant]["contacts"] > 40
        assert len(figures[plant]["estimators"]) == 5


def test_on_the_rubber_balloon_a_calibration_halves_the_error_and_two_u_holds_nine_of_ten(figures):
    estimators = figures["membrane"]["estimators"]
    bare, taught = estimators["energetic"]["all"], estimators["energetic, calibrated"]["all"]
    assert taught["mean_percent"] < bare["mean_percent"] / 2
    assert taught["mean_percent"] <= 5
    assert taught["rmse_n"] < 0.1
    assert taught["held_percent"] >= 90


def test_on_the_published_balloon_the_law_is_right_away_from_its_step(figures):
    by_pressure = figures["published"]["estimators"]["energetic"]["by_pressure_kpa"]
    assert by_pressure["4.95–6.25"]["mean_percent"] < 1
    assert by_pressure["10.15–11.45"]["mean_percent"] < 1


def test_a_calibration_that_gains_nothing_is_counted_as_refused(figures):
    assert figures["published"]["refused_calibrations"]["energetic, calibrated"] == 1
    assert set(figures["membrane"]["refused_calibrations"].values()) == {0}
