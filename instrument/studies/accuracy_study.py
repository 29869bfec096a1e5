"""Accuracy study: each force estimator is compared with the true forces on each simulated balloon."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from typing import NamedTuple, get_args

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import file, parts
from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.calibration.contacts import parse_contacts, read_contacts
from pneuforce.instrument.calibration.force import fit_force
from pneuforce.instrument.calibration.residuals import errors_by_pressure
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.law import PublishedMethod
from pneuforce.instrument.model.pressure_bins import BIN_EDGES_KPA
from pneuforce.instrument.studies.accuracy_document import (
    CONTACTS_PER_CALIBRATION,
    TITLES,
    AccuracyCampaign,
    BalloonAccuracy,
)
from pneuforce.instrument.studies.population_study import PopulationScores
from pneuforce.instrument.studies.reference_contacts import as_csv
from pneuforce.instrument.studies.timed_membrane import RigScore
from pneuforce.instrument.validation.accuracy import AccuracyScore, EstimatorScores, score_estimators
from pneuforce.sim.scenario import PlantTable
from pneuforce.support.columns import Points

LIVE_SETTINGS = ChainSettings()
#: Estimators without a calibration: the default settings with each method.
_METHODS: tuple[PublishedMethod, ...] = get_args(PublishedMethod)
UNCALIBRATED = {method: ChainSettings.of(replace(LIVE_SETTINGS.law, method=method)) for method in _METHODS}
#: Estimators that are calibrated on contacts of the same balloon.
CALIBRATED = {
    "energetic, calibrated": LIVE_SETTINGS,
    "energetic, calibrated, smooth": replace(LIVE_SETTINGS, law=replace(LIVE_SETTINGS.law, low="smooth")),
}


class _CalibratedEstimator(NamedTuple):
    """Settings after a calibration, or without calibration if the calibration was rejected."""

    settings: ChainSettings
    rejected: bool


def evaluate(
    campaign: AccuracyCampaign, report_progress: Callable[[int, int], None]
) -> dict[str, BalloonAccuracy]:
    """Return the results on each simulated balloon. The keys are the kinds of simulated balloon.

    `report_progress` is called with the number of completed steps and the total number of steps.
    """
    results: dict[str, BalloonAccuracy] = {}
    step_count, step = len(TITLES) * (campaign.calibrations + 1), itertools.count(1)
    for plant in TITLES:
        evaluated = _points(plant, campaign.contacts, campaign.seed)
        report_progress(next(step), step_count)
        calibrated: dict[str, list[_CalibratedEstimator]] = {name: [] for name in CALIBRATED}
        # The seeds of the calibrations differ from the seed of the evaluated contacts.
        for seed in range(campaign.seed + 1, campaign.seed + 1 + campaign.calibrations):
            points = _points(plant, CONTACTS_PER_CALIBRATION, seed)
            for name, settings in CALIBRATED.items():
                calibrated[name].append(_calibrate(points, settings))
            report_progress(next(step), step_count)
        results[plant] = _score(evaluated, calibrated)
    return results


def _points(plant: str, count: int, seed: int) -> Points:
    text = "\n".join(as_csv(PlantTable.model_validate({"kind": plant}), count, seed))
    return parse_contacts(text.encode(), plant)


def _calibrate(points: Points, settings: ChainSettings) -> _CalibratedEstimator:
    try:
        calibration = fit_force(read_contacts(points, settings), settings)
    except ConfigurationError:
        return _CalibratedEstimator(settings, rejected=True)
    errors = errors_by_pressure(calibration.chosen.held_out_n, calibration.contacts)
    part = parts.force_part(calibration, errors, points, settings, date.today())
    content = file.empty(0).model_copy(update={"force": part})
    return _CalibratedEstimator(apply_calibration(settings, content), rejected=False)


def _score(points: Points, calibrated: dict[str, list[_CalibratedEstimator]]) -> BalloonAccuracy:
    contacts = read_contacts(points, LIVE_SETTINGS)
    estimators: dict[str, list[ChainSettings]] = {name: [settings] for name, settings in UNCALIBRATED.items()}
    estimators |= {name: [each.settings for each in several] for name, several in calibrated.items()}
    rejected = {name: sum(each.rejected for each in several) for name, several in calibrated.items()}
    return BalloonAccuracy(len(contacts), score_estimators(contacts, estimators), rejected)


def results_to_json(results: dict[str, BalloonAccuracy]) -> dict[str, object]:
    """Return the results as a JSON object. A value that is not available is null."""
    return {
        plant: {
            "contacts": result.contacts,
            "rejected_calibrations": result.rejected,
            "estimators": {estimator.name: _scores_to_json(estimator) for estimator in result.estimators},
        }
        for plant, result in results.items()
    }


def population_to_json(scores: PopulationScores) -> dict[str, object]:
    """Return the scores of a population as a JSON object. A value that is not available is null."""
    return {
        "balloons": scores.balloons,
        "contacts": scores.contacts,
        "without_force": scores.without_force,
        "rejected_calibrations": scores.rejected,
        "estimators": {estimator.name: _scores_to_json(estimator) for estimator in scores.estimators},
    }


def rig_score_to_json(score: RigScore) -> dict[str, object]:
    """Return the results on rigs in time as a JSON object."""
    return {**score._asdict(), "score": _nan_to_none(score.score)}


def _scores_to_json(estimator: EstimatorScores) -> dict[str, object]:
    bins = [f"{low:.2f}–{high:.2f}" for low, high in itertools.pairwise(BIN_EDGES_KPA)]
    by_pressure = zip(bins, estimator.by_pressure, strict=True)
    scores: dict[str, object] = {
        "all": _nan_to_none(estimator.all),
        "by_pressure_kpa": {name: _nan_to_none(score) for name, score in by_pressure},
    }
    return scores | ({"fast": _nan_to_none(estimator.fast)} if estimator.fast else {})


def _nan_to_none(score: AccuracyScore) -> dict[str, float | None]:
    return {name: value if value == value else None for name, value in score._asdict().items()}
