"""Grip of the contact, from known weights on the balloon: 0 if the skin slides on the weight, 1 if it sticks.

A weight presses with F = m g. The method "membrane" gives the force for a skin that slides and for a skin
that sticks, and the grip says how far the force lies between them. A grip a little outside 0 to 1 is
accepted: it also compensates errors that are common to all contacts, such as that of the gas exponent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.contacts import MAX_FORCE_N
from pneuforce.instrument.calibration.option_points import points_from_options
from pneuforce.instrument.calibration.ranges import GRIP_RANGE
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.contact import ONSET_KPA
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.support.columns import Numbers, Points

COLUMNS = (("mass_g", "before_kpa", "after_kpa"),)
MAX_WEIGHTS = 20
MIN_FORCE_N = 0.29  #: a mass of 30 g
#: Standard acceleration of gravity [m/s²], ISO 80000-3. It varies by ±0.3 % on the surface of the earth.
GRAVITY_M_PER_S2 = 9.80665
#: Relative standard uncertainty of a force that is common to all weights: gravity, mass and rubber.
COMMON_RELATIVE_STD = 0.005
#: Standard uncertainty of each pressure that is read from the instrument [kPa].
READING_STD_KPA = 0.005


@dataclass(frozen=True, slots=True)
class GripFit:
    """Grip with its standard uncertainty, and the single results."""

    grip: float
    std: float
    each: Numbers  #: grip of each weight
    force_n: Numbers  #: force of each weight


def weights_from_options(
    mass_g: Sequence[float], before_kpa: Sequence[float], after_kpa: Sequence[float]
) -> Points:
    """Return the weights that are given as command line options.

    Raises ConfigurationError if the three lists differ in length, or if a value is not a usable number.
    """
    columns = dict(zip(COLUMNS[0], (mass_g, before_kpa, after_kpa), strict=True))
    return points_from_options(columns, "weight")


def fit_grip(points: Points, settings: ChainSettings) -> GripFit:
    """Return the grip that explains the weights.

    Raises ConfigurationError, which names the line, if a row cannot be a weight on this balloon.
    """
    if not settings.balloon.is_measured:
        raise ConfigurationError(
            "the grip needs the radii of this balloon: run `pneuforce calibrate radius` first, and "
            "write both to the same file with --out"
        )
    points.require_rows(1)
    if len(points) > MAX_WEIGHTS:
        raise points.error(f"{len(points)} weights, and at most {MAX_WEIGHTS} are allowed")
    before, after = points["before_kpa"], points["after_kpa"]
    force_n = points["mass_g"] * 1e-3 * GRAVITY_M_PER_S2
    _check(points, force_n)
    slide_n, stick_n = (_forces_n(settings, grip, before, after) for grip in (0.0, 1.0))
    unsolved = ~(stick_n > slide_n)
    if unsolved.any():
        raise points.error("the method membrane has no solution for this weight", int(unsolved.argmax()))
    each = (force_n - slide_n) / (stick_n - slide_n)
    weights = 1 / _stds(settings, before, after, stick_n - slide_n) ** 2
    grip = float(np.average(each, weights=weights))
    low, high = GRIP_RANGE
    if not low <= grip <= high:
        raise points.error(
            f"the grip is {grip:.2f}, and {low:g} to {high:g} is plausible: check the masses in grams, the "
            "pressures, pressed_sides, and the calibration of radius and volume"
        )
    return GripFit(grip, _std(each, weights, force_n / (stick_n - slide_n)), each, force_n)


def _forces_n(settings: ChainSettings, grip: float, before_kpa: Numbers, after_kpa: Numbers) -> Numbers:
    law = replace(settings.law, method="membrane", grip=grip)
    model = replace(settings, law=law).force_model
    forces: Numbers = model.estimate(before_kpa, after_kpa).force_n
    return forces


def _stds(settings: ChainSettings, before_kpa: Numbers, after_kpa: Numbers, span_n: Numbers) -> Numbers:
    """Return the standard uncertainty of each grip that comes from the readings of the two pressures."""
    middle = [_forces_n(settings, 0.5, before_kpa, after_kpa + step) for step in (-0.01, 0.01)]
    slope = (middle[1] - middle[0]) / 0.02
    stds: Numbers = np.sqrt(2) * READING_STD_KPA * slope / span_n
    return stds


def _std(each: Numbers, weights: Numbers, force_over_span: Numbers) -> float:
    """Return the standard uncertainty of the grip: readings or scatter of the weights, and common errors."""
    count = len(each)
    from_readings = 1 / math.sqrt(weights.sum())
    scatter = float(np.std(each, ddof=1)) / math.sqrt(count) if count > 2 else 0.0
    common = COMMON_RELATIVE_STD * float(force_over_span.mean())
    return math.hypot(max(from_readings, scatter), common)


def _check(points: Points, force_n: Numbers) -> None:
    """Raise ConfigurationError, which names the line, if a row cannot be a weight on a balloon."""
    before, rise = points["before_kpa"], points["after_kpa"] - points["before_kpa"]
    for invalid, why in (
        (
            (before < VALID_LOW_KPA) | (before > VALID_HIGH_KPA),
            f"before_kpa is outside {VALID_LOW_KPA:g} to {VALID_HIGH_KPA:g} kPa, so that the instrument "
            "shows no force",
        ),
        (
            rise < ONSET_KPA,
            f"after_kpa is not {ONSET_KPA:g} kPa above before_kpa: is the weight on the balloon?",
        ),
        (
            (force_n < MIN_FORCE_N) | (force_n > MAX_FORCE_N),
            f"mass_g must be from 30 to {MAX_FORCE_N / GRAVITY_M_PER_S2 * 1e3:.0f}: is it in grams?",
        ),
    ):
        if invalid.any():
            raise points.error(why, int(invalid.argmax()))
