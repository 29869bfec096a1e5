"""The volume V_c of the pipes by Boyle's law: a syringe of known content is emptied into the plugged circuit.

(P_0 + before)(V_c + displaced) = (P_0 + after) V_c: the rise is (P_0 + before) · displaced / V_c.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from instrument.calibration.least_squares import fit
from instrument.columns import MOST, Numbers, Points
from instrument.errors import ConfigurationError

COLUMNS = (("syringe_ml", "pressure_kpa"), ("volume_mm3", "pressure_kpa"))
ALSO = ("before_kpa",)
LEAST_STROKES = 3
MM3_PER_ML = 1e3
#: Rectangular: ISO 7886-1 allows a syringe ± 4 % of what it expels, and the sensor's gain is known to ± 1 %.
SYSTEMATIC = math.hypot(0.04, 0.01) / math.sqrt(3)
STROKES_MM3 = (10.0, 1e6)
VOLUMES_MM3 = (100.0, 1e6)
#: Rows that disagree by more than this share of the rise: a leak, or a syringe that was not emptied.
DISAGREEMENT = 0.15


@dataclass(frozen=True, slots=True)
class Strokes:
    """Strokes of a syringe, each from full to empty."""

    points: Points
    displaced_mm3: Numbers
    before_kpa: Numbers
    after_kpa: Numbers


@dataclass(frozen=True, slots=True)
class Volume:
    """V_c and how well it is known."""

    volume_mm3: float
    std_mm3: float  #: scatter of the strokes, tolerance of the syringe, gain of the sensor
    residual_kpa: float


def strokes_in(points: Points) -> Strokes:
    """The strokes of a recording; without `before_kpa` each began at ambient pressure."""
    if "syringe_ml" in points.columns:
        displaced_mm3 = points["syringe_ml"] * MM3_PER_ML
    else:
        displaced_mm3 = points["volume_mm3"]
    before_kpa = points.columns.get("before_kpa", np.zeros(len(points)))
    return Strokes(points, displaced_mm3, before_kpa, points["pressure_kpa"])


def strokes_typed(
    displaced_ml: Sequence[float], before_kpa: Sequence[float], after_kpa: Sequence[float]
) -> Strokes:
    """The strokes given as options. Raises ConfigurationError where they are not as many of each."""
    count = len(displaced_ml)
    if not count == len(before_kpa) == len(after_kpa):
        raise ConfigurationError(
            "--displaced-ml, --before-kpa and --after-kpa: give each once for every stroke"
        )
    points = Points("options", "", {}, tuple(range(1, count + 1)))
    displaced, before, after = strokes = np.array([displaced_ml, before_kpa, after_kpa], float)
    if not (np.abs(strokes) <= MOST).all():
        raise ConfigurationError(
            f"--displaced-ml, --before-kpa and --after-kpa must be numbers up to {MOST:g}"
        )
    return Strokes(points, displaced * MM3_PER_ML, before, after)


def volume_of(strokes: Strokes, ambient_kpa: float) -> Volume:
    """V_c. Raises ConfigurationError, with the line, where no circuit can be so."""
    points = strokes.points
    points.at_least(LEAST_STROKES)
    rise = strokes.after_kpa - strokes.before_kpa
    _check_rows(strokes, rise)
    driven = (ambient_kpa + strokes.before_kpa) * strokes.displaced_mm3
    found = fit(driven[:, None], rise)
    volume_mm3 = float(1 / found.coefficients[0])
    low, high = VOLUMES_MM3
    if not low <= volume_mm3 <= high:
        raise points.refusal(
            f"V_c = {volume_mm3:.4g} mm³ cannot be ({low:g} to {high:g} mm³): check the units"
        )
    off = np.abs(found.residuals) / rise
    if off.max() > DISAGREEMENT:
        raise points.refusal(
            f"this stroke disagrees with the others by {100 * off.max():.0f} % of its rise: "
            "a leak, or a syringe that was not emptied",
            int(off.argmax()),
        )
    scatter = float(found.stds[0]) * volume_mm3
    return Volume(volume_mm3, volume_mm3 * math.hypot(scatter, SYSTEMATIC), found.std)


def _check_rows(strokes: Strokes, rise_kpa: Numbers) -> None:
    points = strokes.points
    for row, (displaced, rise) in enumerate(zip(strokes.displaced_mm3, rise_kpa, strict=True)):
        if not STROKES_MM3[0] <= displaced <= STROKES_MM3[1]:
            raise points.refusal(
                f"a displaced volume of {displaced:g} mm³ ({STROKES_MM3[0]:g} to {STROKES_MM3[1]:g} mm³)", row
            )
        if not abs(strokes.before_kpa[row]) <= 50:
            raise points.refusal(f"before_kpa is {strokes.before_kpa[row]:g}: is that hPa or Pa?", row)
        if not rise > 0:
            raise points.refusal(f"the pressure does not rise ({rise:g} kPa) as the syringe is emptied", row)
        if not strokes.after_kpa[row] <= 50:
            raise points.refusal(
                f"{strokes.after_kpa[row]:g} kPa is above the sensor's 50 kPa: is that hPa or Pa?", row
            )
