"""Plausibility of a calibration: the calibrated force on a grid of pressures, and the dates of the parts.

`model.plausibility` contains the limits of the force. `file` contains the limits of the single values.
"""

from __future__ import annotations

import math
from datetime import date, timedelta
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.file import Calibration
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceLaw, estimate
from pneuforce.instrument.model.balloon import MIN_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.correction import ForceCorrection
from pneuforce.instrument.model.law import BLEND_KPA
from pneuforce.instrument.model.plausibility import ForceSpan, method_span, plausible_span
from pneuforce.instrument.model.pressure_bins import BIN_EDGES_KPA, CoveredSpan
from pneuforce.support.columns import Numbers

#: Numbers of baselines and of rises of the grid. Edges of the correction and of the law are added to them.
BASELINE_COUNT, RISE_COUNT = 25, 60
MIN_GRID_RISE_KPA = 0.01
#: Largest rise at the default `contact_limit_kpa` of 18 kPa.
MAX_RISE_KPA = 18.0 - VALID_LOW_KPA


class ForceGrid(NamedTuple):
    """Calibrated forces on a grid. All fields are arrays of equal shape (baselines, rises)."""

    baseline_kpa: Numbers
    rise_kpa: Numbers
    force_n: Numbers
    methods: ForceSpan  #: forces of the published methods

    @property
    def limits(self) -> ForceSpan:
        """Return the span of the plausible forces."""
        return plausible_span(self.rise_kpa, self.methods)

    def worst_point(self) -> tuple[int, int] | None:
        """Return the row and the column of the least plausible force, None if all forces are plausible."""
        limits = self.limits
        implausible = ~limits.contains(self.force_n) & np.isfinite(self.methods.low_n)
        if not implausible.any():
            return None
        with np.errstate(all="ignore"):
            excess = np.fmax(limits.low_n / self.force_n, self.force_n / limits.high_n)
        excess = np.where(implausible, np.nan_to_num(excess, nan=math.inf), 0.0)
        row, column = np.unravel_index(int(excess.argmax()), excess.shape)
        return int(row), int(column)


def check_force(settings: ChainSettings) -> None:
    """Raise ConfigurationError if the calibrated force is implausible at a measured pressure.

    The message gives the pressures, the force, the forces of the published methods, and the remedy.
    """
    correction = settings.correction
    if correction is None:
        return
    grid = _grid(correction.baseline_span_kpa, correction.rise_span_kpa[1], correction, settings)
    _check_growth(grid)
    if point := grid.worst_point():
        raise ConfigurationError(
            f"{_comparison(grid, point)}: repeat the force calibration, and check the reference force sensor "
            "and the units of force and pressure"
        )


def _check_growth(grid: ForceGrid) -> None:
    """Raise ConfigurationError if the corrected force falls while the pressure rises.

    Such a correction would show a smaller force for a harder press.
    """
    with np.errstate(all="ignore"):
        falls = (np.diff(grid.force_n, axis=1) <= 0) & (grid.force_n[:, 1:] > 0)
    if falls.any():
        row, column = np.argwhere(falls)[0]
        raise ConfigurationError(
            "the corrected force would fall as the pressure rises, at ΔP_i = "
            f"{grid.baseline_kpa[row, column]:.2f} kPa and a rise of {grid.rise_kpa[row, column]:.2f} kPa: "
            "repeat the force calibration, and check the reference forces"
        )


def warnings_about(calibration: Calibration, settings: ChainSettings, today: date) -> list[str]:
    """Return warnings about a calibration that is applied to the settings. A warning prevents nothing."""
    future = [part.date for part in calibration.parts if part.date > today + timedelta(days=1)]
    warnings = [
        f"the calibration is dated {day}, but today is {today} by the clock of this computer: set the clock, "
        "or repeat the calibration"
        for day in sorted(set(future))
    ]
    return warnings + _coverage_warnings(settings) + _extrapolation_warnings(settings)


def _coverage_warnings(settings: ChainSettings) -> list[str]:
    """Return a warning if the contacts of the force calibration do not cover a pressure bin."""
    if settings.correction is None:
        return []
    bins = zip(pairwise(BIN_EDGES_KPA), settings.correction.covered_spans, strict=True)
    missing = [text for (begin, end), span in bins if (text := _uncovered_part(begin, end, span))]
    if not missing:
        return []
    return [
        f"the contacts of the force calibration do not cover ΔP_i of {', '.join(missing)} kPa: the "
        "uncertainty before the calibration is added there; add contacts there"
    ]


def _uncovered_part(begin_kpa: float, end_kpa: float, span: CoveredSpan | None) -> str:
    """Return a text for the pressure bin, or "" if the contacts cover it."""
    text = f"{begin_kpa}–{end_kpa}"
    if span is None:
        return text
    low_kpa, high_kpa = span.baseline_span_kpa
    if low_kpa <= begin_kpa and end_kpa <= high_kpa:
        return ""
    return f"{text} (but {max(begin_kpa, low_kpa):.2f}–{min(end_kpa, high_kpa):.2f})"


def _extrapolation_warnings(settings: ChainSettings) -> list[str]:
    """Return a warning if the calibrated force is implausible at a pressure that was not measured.

    The instrument shows no force at this pressure.
    """
    if settings.correction is None:
        return []
    grid = _grid((VALID_LOW_KPA, VALID_HIGH_KPA), MAX_RISE_KPA, settings.correction, settings)
    point = grid.worst_point()
    if point is None:
        return []
    return [
        "the instrument shows no force at some pressures that the force calibration does not contain: "
        f"{_comparison(grid, point)}; add contacts at this ΔP_i to the force calibration"
    ]


def _comparison(grid: ForceGrid, point: tuple[int, int]) -> str:
    """Return a text that compares the force at one point with the forces of the methods and the limits."""
    values = (grid.baseline_kpa, grid.rise_kpa, grid.force_n, *grid.methods, *grid.limits)
    baseline, rise, force, low, high, lowest, highest = (float(value[point]) for value in values)
    return (
        f"at ΔP_i = {baseline:.2f} kPa and a rise of {rise:.2f} kPa, the calibrated force is {force:.3g} N, "
        f"but the published methods give {low:.3g} to {high:.3g} N, so that only {lowest:.3g} to "
        f"{highest:.3g} N is plausible"
    )


def _grid(
    baseline_span_kpa: tuple[float, float],
    highest_rise_kpa: float,
    correction: ForceCorrection,
    settings: ChainSettings,
) -> ForceGrid:
    """Return the corrected forces on a grid of a span of ΔP_i, and of rises from zero.

    Where a published method has no solution, the force of this method is unknown, and `methods` is NaN.
    """
    balloon, circuit, law = settings.balloon, settings.circuit, settings.law
    rises = _rises(highest_rise_kpa, correction)
    baseline, rise = np.meshgrid(_baselines(baseline_span_kpa, correction), rises, indexing="ij")
    law_n = settings.force_model.estimate(baseline, baseline + rise).force_n
    methods = method_span(baseline, rise, balloon, circuit, law.switch)
    energetic_n = estimate(baseline, baseline + rise, balloon, circuit, ForceLaw(switch=law.switch)).force_n
    unknown = ~np.isfinite(energetic_n + law_n)
    low_n, high_n = (np.where(unknown, np.nan, force_n) for force_n in methods)
    with np.errstate(all="ignore"):
        force_n = law_n * correction.factor(rise, baseline)
    return ForceGrid(baseline, rise, force_n, ForceSpan(low_n, high_n))


def _baselines(span_kpa: tuple[float, float], correction: ForceCorrection) -> Numbers:
    """Return values of ΔP_i in a span, with the edges at which law or correction change."""
    low_kpa, high_kpa = span_kpa
    switch_kpa = correction.balloon.switch_kpa
    edges = [
        *correction.baseline_span_kpa,
        switch_kpa,
        np.nextafter(switch_kpa, math.inf),
        switch_kpa - BLEND_KPA,
        switch_kpa + BLEND_KPA,
    ]
    values = np.concatenate([np.linspace(low_kpa, high_kpa, BASELINE_COUNT), edges])
    return np.unique(values.clip(low_kpa, high_kpa))


def _rises(highest_kpa: float, correction: ForceCorrection) -> Numbers:
    """Return rises from zero to the highest rise, with the edges at which law or correction change.

    The highest rise is at least 0.5 kPa, because all smaller rises are interpolated from there.
    """
    highest_kpa = max(highest_kpa, MIN_RISE_KPA)
    steps = np.geomspace(MIN_GRID_RISE_KPA, highest_kpa, RISE_COUNT)
    values = np.concatenate([[0.0, MIN_RISE_KPA], steps, correction.rise_span_kpa])
    return np.unique(values.clip(0.0, highest_kpa))
