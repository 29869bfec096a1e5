"""`pneuforce accuracy`: each estimator against the truth of each simulated balloon."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from datetime import date
from typing import NamedTuple, get_args

from instrument.calibration import contacts as cell
from instrument.calibration import file, parts
from instrument.calibration.applied import calibrated
from instrument.calibration.force import calibration_of
from instrument.calibration.residuals import bins
from instrument.chain import ChainSettings
from instrument.cli.accuracy_page import CONTACTS_PER_CALIBRATION, TITLES, Campaign, Judged, page
from instrument.cli.reference_contacts import as_csv
from instrument.cli.showing import progress
from instrument.columns import Points, points_in
from instrument.errors import ConfigurationError
from instrument.fifths import EDGES_KPA
from instrument.model.law import MethodName
from instrument.model.uncertainty import ModelErrors
from instrument.validation.accuracy import Estimator, Score, scored

LIVE_SETTINGS = ChainSettings()
BARE = {
    method: replace(
        LIVE_SETTINGS, law=replace(LIVE_SETTINGS.law, method=method), model=ModelErrors.of(method)
    )
    for method in get_args(MethodName)
}
CALIBRATED = {
    "energetic, calibrated": LIVE_SETTINGS,
    "the same, smooth": replace(LIVE_SETTINGS, law=replace(LIVE_SETTINGS.law, low="smooth")),
}


class _Taught(NamedTuple):
    """The settings after a calibration; the bare law's where it was refused."""

    settings: ChainSettings
    refused: bool


def accuracy(campaign: Campaign, as_json: bool) -> str:
    """The page in Markdown, or its figures as JSON."""
    judged: dict[str, Judged] = {}
    steps, done = len(TITLES) * (campaign.calibrations + 1), itertools.count(1)
    with progress("contacts on the simulated rig") as told:
        for plant in TITLES:
            points = _points(plant, campaign.contacts, campaign.seed)
            told(next(done), steps)
            taught: dict[str, list[_Taught]] = {name: [] for name in CALIBRATED}
            # Calibrations have the seeds after that of the contacts on which they are judged.
            for seed in range(campaign.seed + 1, campaign.seed + 1 + campaign.calibrations):
                lesson = _points(plant, CONTACTS_PER_CALIBRATION, seed)
                for name, own in CALIBRATED.items():
                    taught[name].append(_taught(lesson, own))
                told(next(done), steps)
            judged[plant] = _judged(points, taught)
    if as_json:
        tables = {plant: _figures(found) for plant, found in judged.items()}
        return json.dumps(tables, indent=2, ensure_ascii=False)
    return "\n".join(page(campaign, judged))


def _points(plant: str, count: int, seed: int) -> Points:
    text = "\n".join(as_csv(plant, count, seed))
    return points_in(text.encode(), plant, cell.COLUMNS, cell.ALSO)


def _taught(points: Points, own: ChainSettings) -> _Taught:
    try:
        fitted = calibration_of(cell.contacts_in(points, own), own)
    except ConfigurationError:
        return _Taught(own, True)
    part = parts.force_part(fitted, bins(fitted.chosen.unseen_n, fitted.contacts), points, own, date.today())
    return _Taught(calibrated(own, file.empty(0).model_copy(update={"force": part})), False)


def _judged(points: Points, taught: dict[str, list[_Taught]]) -> Judged:
    fresh = cell.contacts_in(points, LIVE_SETTINGS)
    settings = {name: [own] for name, own in BARE.items()}
    settings |= {name: [one.settings for one in several] for name, several in taught.items()}
    refused = {name: sum(one.refused for one in several) for name, several in taught.items()}
    return Judged(len(fresh), scored(fresh, settings), refused)


def _figures(found: Judged) -> dict[str, object]:
    return {
        "contacts": found.contacts,
        "refused_calibrations": found.refused,
        "estimators": {estimator.name: _scores(estimator) for estimator in found.estimators},
    }


def _scores(estimator: Estimator) -> dict[str, object]:
    spans = [f"{low:.2f}–{high:.2f}" for low, high in itertools.pairwise(EDGES_KPA)]
    by_pressure = zip(spans, estimator.by_pressure, strict=True)
    return {
        "all": _known(estimator.all),
        "by_pressure_kpa": {span: _known(score) for span, score in by_pressure},
    }


def _known(score: Score) -> dict[str, float | None]:
    return {name: value if value == value else None for name, value in score._asdict().items()}
