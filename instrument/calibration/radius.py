"""The radius of the free balloon over its pressure, from a caliper: R_i = R_0 + linear ΔP + quadratic ΔP²."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median

import numpy as np

from instrument.calibration.least_squares import Fit, fit
from instrument.calibration.rubber import Rubber, rubber_of
from instrument.columns import Numbers, Points
from instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA

COLUMNS = (("pressure_kpa", "diameter_mm"), ("pressure_kpa", "radius_mm"))
LEAST_POINTS = 6
LEAST_SPAN_KPA = 3.0
#: A radius this far below one at a lower pressure is no scatter of a caliper (0.03 mm), but another balloon.
FALL_MM = 0.15
#: How well the fit must tell the radius at rest and at both ends of the validated range [mm].
MOST_STD_MM = 0.2
LEAST_SLOPE_MM_PER_KPA = 0.001
RADII_MM = (1.5, 30.0)


@dataclass(frozen=True, slots=True)
class Radius:
    """The quadratic, and the rubber that comes nearest."""

    quadratic: Fit  #: of R_0 [mm], linear [mm/kPa], quadratic [mm/kPa²]
    rubber: Rubber

    def radius_mm(self, pressure_kpa: float) -> float:
        """R_i [mm] at ΔP_i."""
        return float(_basis(np.array([pressure_kpa]))[0] @ self.quadratic.coefficients)

    def std_mm(self, pressure_kpa: float) -> float:
        """Standard uncertainty of R_i [mm] at ΔP_i."""
        x = _basis(np.array([pressure_kpa]))[0]
        return float(np.sqrt(x @ self.quadratic.covariance @ x))


def radius_of(points: Points) -> Radius:
    """The fit. Raises ConfigurationError, with the line, where the points cannot be a balloon's."""
    points.at_least(LEAST_POINTS)
    pressure, radius = points["pressure_kpa"], radii_mm(points)
    _check_units(points, pressure, radius)
    _check_growth(points, pressure, radius)
    if np.ptp(pressure) < LEAST_SPAN_KPA or len(set(pressure.round(1))) < LEAST_POINTS // 2:
        raise points.refusal(
            f"the pressures span {np.ptp(pressure):.2f} kPa: at least {LEAST_SPAN_KPA:g} kPa, and "
            f"{LEAST_POINTS // 2} of them, are needed to tell a curve"
        )
    quadratic = fit(_basis(pressure), radius)
    found = Radius(quadratic, rubber_of(pressure, radius, quadratic.coefficients[0]))
    _check_reach(points, found)
    return found


def radii_mm(points: Points) -> Numbers:
    """The radii, halves of the diameters where those were measured."""
    return points["radius_mm"] if "radius_mm" in points.columns else points["diameter_mm"] / 2


def _basis(pressure_kpa: Numbers) -> Numbers:
    return np.stack([np.ones_like(pressure_kpa), pressure_kpa, pressure_kpa**2], axis=1)


def _check_units(points: Points, pressure_kpa: Numbers, radius_mm: Numbers) -> None:
    pressure_unit = unit_of_pressures(pressure_kpa)
    if pressure_unit:
        raise points.refusal(
            f"pressures up to {pressure_kpa.max():g} look like {pressure_unit}; they must be in kPa (gauge)"
        )
    if (pressure_kpa < 0).any():
        raise points.refusal("pressure_kpa is below 0", int(pressure_kpa.argmin()))
    middle_mm = median(radius_mm.tolist())
    if not RADII_MM[0] <= middle_mm <= RADII_MM[1]:
        unit = (
            "m" if middle_mm < 0.1 else "cm" if middle_mm < RADII_MM[0] else "µm" if middle_mm > 1e3 else ""
        )
        looks = f"looks like {unit}: it must be in mm" if unit else "is no balloon's"
        raise points.refusal(f"a radius of {middle_mm:g} {looks} ({RADII_MM[0]:g} to {RADII_MM[1]:g} mm)")


def unit_of_pressures(pressure_kpa: Numbers) -> str:
    """The unit that the highest of these pressures suggests, empty where it may be kPa."""
    highest = float(pressure_kpa.max())
    return next((unit for limit, unit in ((1000.0, "Pa"), (50.0, "hPa")) if highest > limit), "") or (
        "bar or MPa" if highest < 0.5 else ""
    )


def _check_growth(points: Points, pressure_kpa: Numbers, radius_mm: Numbers) -> None:
    order = np.argsort(pressure_kpa, kind="stable")
    highest = np.maximum.accumulate(radius_mm[order])
    falls = np.flatnonzero(radius_mm[order] < highest - FALL_MM)
    if len(falls):
        row = int(order[falls[0]])
        raise points.refusal(
            f"the radius {radius_mm[row]:.3f} mm at {pressure_kpa[row]:g} kPa is smaller than "
            f"{highest[falls[0]]:.3f} mm at a lower pressure: a slip, or a balloon past its limit point",
            row,
        )


def _check_reach(points: Points, found: Radius) -> None:
    for pressure_kpa in (0.0, VALID_LOW_KPA, VALID_HIGH_KPA):
        std_mm = found.std_mm(pressure_kpa)
        if not std_mm <= MOST_STD_MM:
            raise points.refusal(
                f"these points tell the radius at {pressure_kpa:g} kPa only to ±{std_mm:.2f} mm "
                f"({MOST_STD_MM:g} mm at most): measure over a wider span of pressures"
            )
    _, linear, quadratic = found.quadratic.coefficients
    if (
        not min(linear + 2 * quadratic * kpa for kpa in (VALID_LOW_KPA, VALID_HIGH_KPA))
        > LEAST_SLOPE_MM_PER_KPA
    ):
        raise points.refusal("the fitted radius does not grow with the pressure from 4.95 to 11.45 kPa")
