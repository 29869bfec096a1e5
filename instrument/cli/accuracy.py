"""`pneuforce accuracy`: each estimator against the truth of each simulated balloon, as a page."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from itertools import pairwise
from typing import get_args

from rich.console import Console
from rich.progress import Progress

from instrument.calibration import contacts as cell
from instrument.calibration import file, parts
from instrument.calibration.applied import calibrated
from instrument.calibration.columns import Recording, recording
from instrument.calibration.force import calibration_of
from instrument.calibration.residuals import bins
from instrument.chain import ChainSettings
from instrument.cli.contacts import as_csv
from instrument.errors import ConfigurationError
from instrument.model.law import MethodName
from instrument.validation.accuracy import EDGES_KPA, Errors, Estimator, evaluated

PLANTS = ("published", "membrane")
CONTACTS_PER_CALIBRATION = 24
LIVE_SETTINGS = ChainSettings()
BARE = {
    method: replace(LIVE_SETTINGS, law=replace(LIVE_SETTINGS.law, method=method))
    for method in get_args(MethodName)
}
CALIBRATED = {
    "energetic, calibrated": LIVE_SETTINGS,
    "the same, smooth": replace(LIVE_SETTINGS, law=replace(LIVE_SETTINGS.law, low="smooth")),
}
#: Calibrations have the seeds after that of the contacts on which they are judged.
INTRODUCTION = """\
Plateaus of 0.2 to 3.5 N at setpoints of 5.05 to 11.35 kPa on the simulated rig, with the noise of its ADC,
its filter and its leak, through the instrument's own link and chain, as it is delivered; the truth is the
simulator's, read by a force cell with a noise of 0.01 N. Each cell: mean absolute error of the forces from
1 to 3.5 N · RMSE of the forces below 1 N · contacts whose truth lies within ±2u (a normal error: 95 %).

*Calibrated* is the average over {calibrations} calibrations by `pneuforce calibrate force`, each with
{points} contacts of its own, none of which is judged here. *Smooth* is the same with `low = "smooth"`.
"""
TITLES = {
    "published": "The published balloon, which obeys the energetic law",
    "membrane": "The rubber balloon, which nobody fitted to the law",
}


def accuracy(contacts: int, calibrations: int, seed: int, as_json: bool) -> str:
    """The page in Markdown, or its figures as JSON."""
    found: dict[str, tuple[int, list[Estimator]]] = {}
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("contacts on the simulated rig", total=len(PLANTS) * (calibrations + 1))
        for plant in PLANTS:
            points = _points(plant, contacts, seed)
            progress.advance(task)
            estimators = {name: [own] for name, own in BARE.items()}
            for n in range(1, calibrations + 1):
                taught = _points(plant, CONTACTS_PER_CALIBRATION, seed + n)
                for name, own in CALIBRATED.items():
                    estimators.setdefault(name, []).append(_calibrated(taught, own))
                progress.advance(task)
            fresh = cell.contacts_in(points, ChainSettings())
            found[plant] = len(fresh), evaluated(fresh, estimators)
    if as_json:
        return json.dumps({plant: _figures(*of) for plant, of in found.items()}, indent=2, ensure_ascii=False)
    return "\n".join(_page(found, contacts, calibrations, seed))


def _points(plant: str, count: int, seed: int) -> Recording:
    text = "\n".join(as_csv(plant, count, seed))
    return recording(text.encode(), plant, cell.COLUMNS, cell.ALSO)


def _calibrated(points: Recording, own: ChainSettings) -> ChainSettings:
    """The settings after a calibration on these contacts; unchanged where they support none."""
    try:
        fitted = calibration_of(cell.contacts_in(points, own), own)
    except ConfigurationError:
        return own
    part = parts.force_part(fitted, bins(fitted.chosen.unseen_n, fitted.contacts), points, own, date.today())
    return calibrated(own, file.empty(0).model_copy(update={"force": part}))


def _figures(count: int, estimators: list[Estimator]) -> dict[str, object]:
    spans = [f"{low:.2f}–{high:.2f}" for low, high in pairwise(EDGES_KPA.tolist())]
    return {
        "contacts": count,
        "estimators": {
            e.name: {
                "all": _known(e.all),
                "by_pressure_kpa": {
                    s: _known(errors) for s, errors in zip(spans, e.by_pressure, strict=True)
                },
            }
            for e in estimators
        },
    }


def _known(errors: Errors) -> dict[str, float | None]:
    return {name: value if value == value else None for name, value in errors._asdict().items()}


def _page(
    found: dict[str, tuple[int, list[Estimator]]], contacts: int, calibrations: int, seed: int
) -> Iterator[str]:
    yield "# Accuracy on the simulated balloons"
    yield ""
    yield f"Made by `pneuforce accuracy --contacts {contacts} --calibrations {calibrations} --seed {seed}`."
    yield ""
    yield from INTRODUCTION.format(calibrations=calibrations, points=CONTACTS_PER_CALIBRATION).splitlines()
    for plant, (count, estimators) in found.items():
        yield ""
        yield f"## {TITLES[plant]} (`{plant}`)"
        yield ""
        spans = [f"{low:.2f}–{high:.2f} kPa" for low, high in pairwise(EDGES_KPA.tolist())]
        yield "| " + " | ".join(["estimator", f"all {count} contacts", *spans]) + " |"
        yield "| --- " * (len(spans) + 2) + "|"
        for estimator in estimators:
            cells = [_cell(errors) for errors in (estimator.all, *estimator.by_pressure)]
            yield "| " + " | ".join([estimator.name, *cells]) + " |"


def _cell(errors: Errors) -> str:
    return f"{errors.mean_percent:.1f} % · {errors.rmse_n:.3f} N · {errors.held_percent:.0f} %"
