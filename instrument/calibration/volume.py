"""Volume V_c of the tubes by Boyle's law: a syringe of known volume is emptied into the plugged circuit.

With the gauge pressures before and after a stroke, and the displaced volume of the syringe:
(P_0 + before)(V_c + displaced) = (P_0 + after) V_c, so that the rise is (P_0 + before) · displaced / V_c.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneuforce.instrument.calibration.least_squares import fit_linear
from pneuforce.instrument.calibration.option_points import points_from_options
from pneuforce.support.columns import Numbers, Points

COLUMNS = (("syringe_ml", "pressure_kpa"), ("volume_mm3", "pressure_kpa"))
OPTIONAL_COLUMNS = ("before_kpa",)
MIN_STROKES = 3
MM3_PER_ML = 1e3
#: Relative standard uncertainty that is common to all strokes. ISO 7886-1 allows a syringe ±4 % of the
#: expelled volume, and the gain of the sensor is known to ±1 %. Both distributions are taken as rectangular.
SYSTEMATIC_RELATIVE_STD = math.hypot(0.04, 0.01) / math.sqrt(3)
DISPLACED_RANGE_MM3 = (10.0, 1e6)
VOLUME_RANGE_MM3 = (100.0, 1e6)
MAX_PRESSURE_KPA = 50.0  #: full scale of the sensor
#: Largest accepted deviation of a stroke from the fit, as a share of its rise. A larger deviation means a
#: leak, or a syringe that was not emptied.
MAX_DEVIATION_RATIO = 0.15


@dataclass(frozen=True, slots=True)
class SyringeStrokes:
    """Strokes of a syringe, each from full to empty."""

    points: Points
    displaced_mm3: Numbers
    before_kpa: Numbers
    after_kpa: Numbers


@dataclass(frozen=True, slots=True)
class VolumeFit:
    """Fitted volume V_c and its uncertainty."""

    volume_mm3: float
    #: Standard uncertainty from the scatter of the strokes, the tolerance of the syringe and the sensor gain.
    std_mm3: float
    residual_kpa: float


def read_strokes(points: Points) -> SyringeStrokes:
    """Return the strokes of a recording.

    Each stroke begins at ambient pressure if there is no column `before_kpa`.
    """
    if "syringe_ml" in points.columns:
        displaced_mm3 = points["syringe_ml"] * MM3_PER_ML
    else:
        displaced_mm3 = points["volume_mm3"]
    before_kpa = points.columns.get("before_kpa", np.zeros(len(points)))
    return SyringeStrokes(points, displaced_mm3, before_kpa, points["pressure_kpa"])


def strokes_from_options(
    displaced_ml: Sequence[float], before_kpa: Sequence[float], after_kpa: Sequence[float]
) -> SyringeStrokes:
    """Return the strokes that are given as command line options.

    Raises ConfigurationError if the three lists differ in length, or if a value is not a usable number.
    """
    columns = {"displaced_ml": displaced_ml, "before_kpa": before_kpa, "after_kpa": after_kpa}
    points = points_from_options(columns, "stroke")
    displaced_mm3 = points["displaced_ml"] * MM3_PER_ML
    return SyringeStrokes(points, displaced_mm3, points["before_kpa"], points["after_kpa"])


def fit_volume(strokes: SyringeStrokes, ambient_kpa: float) -> VolumeFit:
    """Return V_c, fitted to the strokes at the ambient pressure P_0.

    Raises ConfigurationError if the strokes cannot come from one circuit. The message names the line of a
    wrong stroke.
    """
    points = strokes.points
    points.require_rows(MIN_STROKES)
    rise = strokes.after_kpa - strokes.before_kpa
    _check_strokes(strokes, rise)
    driven = (ambient_kpa + strokes.before_kpa) * strokes.displaced_mm3
    fit = fit_linear(driven[:, None], rise)
    volume_mm3 = float(1 / fit.coefficients[0])
    low_mm3, high_mm3 = VOLUME_RANGE_MM3
    if not low_mm3 <= volume_mm3 <= high_mm3:
        raise points.error(
            f"V_c = {volume_mm3:.4g} mm³ is outside {low_mm3:g} to {high_mm3:g} mm³: check the units"
        )
    deviations = np.abs(fit.residuals) / rise
    if deviations.max() > MAX_DEVIATION_RATIO:
        raise points.error(
            f"this stroke deviates from the other strokes by {100 * deviations.max():.0f} % of its rise: "
            "a leak, or a syringe that was not emptied",
            int(deviations.argmax()),
        )
    scatter = float(fit.stds[0]) * volume_mm3
    return VolumeFit(volume_mm3, volume_mm3 * math.hypot(scatter, SYSTEMATIC_RELATIVE_STD), fit.std)


def _check_strokes(strokes: SyringeStrokes, rise_kpa: Numbers) -> None:
    points, (low_mm3, high_mm3) = strokes.points, DISPLACED_RANGE_MM3
    for row, (displaced, rise) in enumerate(zip(strokes.displaced_mm3, rise_kpa, strict=True)):
        before, after = strokes.before_kpa[row], strokes.after_kpa[row]
        if not low_mm3 <= displaced <= high_mm3:
            raise points.error(
                f"a displaced volume of {displaced:g} mm³ is outside {low_mm3:g} to {high_mm3:g} mm³", row
            )
        if not abs(before) <= MAX_PRESSURE_KPA:
            raise points.error(
                f"before_kpa = {before:g} is beyond the {MAX_PRESSURE_KPA:g} kPa of the sensor: "
                "is the unit hPa or Pa?",
                row,
            )
        if not rise > 0:
            raise points.error(f"the pressure does not rise ({rise:g} kPa) as the syringe is emptied", row)
        if not after <= MAX_PRESSURE_KPA:
            raise points.error(
                f"{after:g} kPa is above the {MAX_PRESSURE_KPA:g} kPa of the sensor: is the unit hPa or Pa?",
                row,
            )
