"""Accuracy on a population of balloons: errors of each estimator, and the coverage of its uncertainty."""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import date
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import contacts as reference
from pneuforce.instrument.calibration import file, grip, parts, radius
from pneuforce.instrument.calibration.apply import apply_calibration
from pneuforce.instrument.calibration.force import fit_force
from pneuforce.instrument.calibration.residuals import errors_by_pressure
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import LIVE_LAW
from pneuforce.instrument.model.pressure_bins import BIN_COUNT, pressure_bin_indices
from pneuforce.instrument.model.uncertainty_budget import CONTACT_S
from pneuforce.instrument.studies.balloon_population import (
    REFERENCE_STD_N,
    WEIGHT_G,
    BalloonData,
    Contacts,
    Floats,
    draw,
    measure,
)
from pneuforce.instrument.validation.accuracy import AccuracyScore, EstimatorScores, estimate_forces
from pneuforce.support.columns import Points

ENERGETIC, MEMBRANE = LIVE_LAW, replace(LIVE_LAW, method="membrane")
#: Names of the estimators, in the order of the document.
ESTIMATORS = (
    "energetic",
    "energetic, radius",
    "energetic, force sensor",
    "membrane",
    "membrane, radius",
    "membrane, radius, one weight",
    "membrane, radius, one weight, force sensor",
)


class Estimates(NamedTuple):
    """Forces that one estimator gives for the contacts of one balloon."""

    force_n: Floats
    std_n: Floats


class BalloonEstimates(NamedTuple):
    """Contacts of one balloon, and the forces of all estimators."""

    contacts: Contacts
    fast: Contacts
    by_estimator: dict[str, Estimates]
    fast_by_estimator: dict[str, Estimates]
    rejected: tuple[str, ...]  #: estimators whose calibration was rejected


class PopulationScores(NamedTuple):
    """Scores of all estimators over a population."""

    balloons: int
    contacts: int
    estimators: list[EstimatorScores]
    without_force: dict[str, int]  #: number of contacts without a force, by estimator
    rejected: dict[str, int]  #: number of rejected calibrations, by estimator


def evaluate_population(
    balloons: int, seed: int, report_progress: Callable[[int, int], None]
) -> PopulationScores:
    """Return the scores over a population of simulated balloons.

    The balloons are computed by one process for each processor, about ten seconds each. `report_progress` is
    called with the number of completed balloons and the total number.
    """
    results: list[BalloonEstimates] = []
    tasks = [(number, seed) for number in range(balloons)]
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        with _delayed_ctrl_c():
            pool = stack.enter_context(multiprocessing.Pool(initializer=_use_cache, initargs=(folder,)))
        for result in pool.imap(_estimate, tasks):  # in the order of the balloons
            results.append(result)
            report_progress(len(results), balloons)
    return _scores(results)


@contextmanager
def _delayed_ctrl_c() -> Iterator[None]:
    """Delay Ctrl-C until the processes have started, because Python would lose it in a fork.

    The started processes never receive Ctrl-C: the parent process ends them.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _use_cache(folder: str) -> None:
    """Let this process keep the tables of the population in a folder that is deleted afterwards."""
    os.environ["XDG_CACHE_HOME"] = folder


def _estimate(task: tuple[int, int]) -> BalloonEstimates:
    return estimate_balloon(*task)


def estimate_balloon(number: int, seed: int) -> BalloonEstimates:
    """Return the forces of all estimators on one balloon of the population."""
    generator = np.random.default_rng([seed, number])
    data = measure(draw(number, generator), generator)
    by_estimator, fast_by_estimator, rejected = {}, {}, []
    for name in ESTIMATORS:
        settings, is_rejected = _settings(name, data)
        rejected += [name] if is_rejected else []
        by_estimator[name] = _forces(data.evaluated, settings, CONTACT_S)
        fast_by_estimator[name] = _forces(data.fast, settings, contact_s=0.0)
    return BalloonEstimates(data.evaluated, data.fast, by_estimator, fast_by_estimator, tuple(rejected))


def _forces(contacts: Contacts, settings: ChainSettings, contact_s: float) -> Estimates:
    pairs = zip(contacts.baseline_kpa, contacts.final_kpa, strict=True)
    return Estimates(*estimate_forces(pairs, settings, contact_s))


def _settings(name: str, data: BalloonData) -> tuple[ChainSettings, bool]:
    """Return the settings of an estimator with its calibrations, and True if a calibration was rejected."""
    method, *calibrations = name.split(", ")
    law = MEMBRANE if method == "membrane" else ENERGETIC
    plain = ChainSettings.of(replace(law, sides=data.balloon.sides))
    content = file.empty(0)
    settings = plain
    for calibration in calibrations:
        try:
            part = _PARTS[calibration](data, settings)
            content = content.model_copy(update=part)
            settings = apply_calibration(plain, content)
        except ConfigurationError:
            return settings, True
    return settings, False


def _radius(data: BalloonData, settings: ChainSettings) -> dict[str, object]:  # noqa: ARG001
    points = _points("radius", pressure_kpa=data.radius_kpa, radius_mm=data.radius_mm)
    return {"radius": parts.radius_part(radius.fit_radius(points), points, date.today())}


def _weight(data: BalloonData, settings: ChainSettings) -> dict[str, object]:
    before, after, _ = data.weight
    points = _points("weight", mass_g=np.full(len(before), WEIGHT_G), before_kpa=before, after_kpa=after)
    return {"grip": parts.grip_part(grip.fit_grip(points, settings), points, settings, date.today())}


def _force(data: BalloonData, settings: ChainSettings) -> dict[str, object]:
    stds = np.full(len(data.calibration.force_n), REFERENCE_STD_N)
    points = _points("contacts", **data.calibration._asdict(), force_std_n=stds)
    found = fit_force(reference.read_contacts(points, settings), settings)
    by_pressure = errors_by_pressure(found.chosen.held_out_n, found.contacts)
    return {"force": parts.force_part(found, by_pressure, points, settings, date.today())}


_PARTS = {"radius": _radius, "one weight": _weight, "force sensor": _force}


def _points(name: str, **columns: Floats) -> Points:
    count = len(next(iter(columns.values())))
    return Points(name, "", columns, tuple(range(1, count + 1)))


def _scores(results: list[BalloonEstimates]) -> PopulationScores:
    contacts = Contacts(*_joined(r.contacts for r in results))
    fast = Contacts(*_joined(r.fast for r in results))
    bins = pressure_bin_indices(contacts.baseline_kpa)
    scores, without = [], {}
    for name in ESTIMATORS:
        found = Estimates(*_joined(r.by_estimator[name] for r in results))
        known = np.isfinite(found.force_n + found.std_n)
        groups = [known, *(known & (bins == index) for index in range(BIN_COUNT))]
        each = [_score(contacts, found, group) for group in groups]
        found = Estimates(*_joined(r.fast_by_estimator[name] for r in results))
        of_fast = _score(fast, found, np.isfinite(found.force_n + found.std_n))
        scores.append(EstimatorScores(name, each[0], tuple(each[1:]), of_fast))
        without[name] = int((~known).sum())
    rejected = {name: sum(name in result.rejected for result in results) for name in ESTIMATORS}
    return PopulationScores(len(results), len(contacts.force_n), scores, without, rejected)


def _joined(parts: Iterable[tuple[Floats, ...]]) -> Iterator[Floats]:
    """Yield each column of all parts as one array."""
    for columns in zip(*parts, strict=True):
        yield np.concatenate(columns)


def _score(contacts: Contacts, found: Estimates, group: npt.NDArray[np.bool_]) -> AccuracyScore:
    true_n, (force_n, std_n) = contacts.force_n[group], (values[group] for values in found)
    error, large = force_n - true_n, true_n >= reference.RELATIVE_ERROR_MIN_N
    return AccuracyScore(
        100 * float(np.abs(error / true_n)[large].mean()) if large.any() else np.nan,
        float(np.sqrt((error[~large] ** 2).mean())) if (~large).any() else np.nan,
        100 * float((np.abs(error) <= 2 * std_n).mean()) if len(error) else np.nan,
    )
