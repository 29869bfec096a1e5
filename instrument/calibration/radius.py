"""Fit of the free radius over pressure, from caliper readings: R_i = R_0 + linear ΔP + quadratic ΔP²."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median

import numpy as np

from pneuforce.instrument.calibration.least_squares import LinearFit, fit_linear
from pneuforce.instrument.calibration.ranges import REST_RADIUS_RANGE_MM
from pneuforce.instrument.calibration.rubber import NeoHookeanFit, fit_neo_hookean
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.rubber import RubberSkin, fit_skin
from pneuforce.support.columns import Numbers, Points

COLUMNS = (("pressure_kpa", "diameter_mm"), ("pressure_kpa", "radius_mm"))
MIN_POINTS = 6
MIN_SPAN_KPA = 3.0
FITTED_CONSTANTS = 3  #: number of constants of the skin
#: Largest accepted fall of the radius as the pressure grows. The scatter of a caliper is only 0.03 mm.
#: Causes of a larger fall are a slipped caliper, another balloon, or a balloon beyond its limit point.
MAX_FALL_MM = 0.15
#: Highest accepted standard uncertainty of the radius, at rest and at both ends of the validated range.
MAX_STD_MM = 0.2
#: If the lowest pressure of the points is higher, R_0 is extrapolated far. On a neo-Hookean balloon, R_0 is
#: 0.1 mm too large with points from 2 kPa on, and 0.4 mm with points from 5 kPa on.
MAX_LOWEST_KPA = 2.5
MIN_SLOPE_MM_PER_KPA = 0.001
RADIUS_RANGE_MM = (1.5, 30.0)


@dataclass(frozen=True, slots=True)
class RadiusFit:
    """Quadratic fit of the radius, and a neo-Hookean fit of the same points."""

    quadratic: LinearFit  #: coefficients R_0 [mm], linear [mm/kPa], quadratic [mm/kPa²]
    rubber: NeoHookeanFit
    skin: RubberSkin  #: Mooney–Rivlin skin, for the method "membrane"
    skin_residual_mm: float  #: standard deviation of the radii from the curve of the skin
    lowest_kpa: float  #: lowest pressure of the points

    @property
    def extrapolation_warning(self) -> str:
        """Return a warning if R_0 is extrapolated from points far above a pressure of zero, otherwise ""."""
        if self.lowest_kpa <= MAX_LOWEST_KPA:
            return ""
        rest_mm = self.quadratic.coefficients[0]
        return (
            f"R_0 = {rest_mm:.3f} mm is extrapolated, because the lowest pressure of the points is "
            f"{self.lowest_kpa:.2g} kPa; u does not contain the error of the extrapolation, and the skin of "
            f"the method membrane has {self.skin.rest_radius_mm:.3f} mm: measure from 2 kPa on"
        )

    def radius_mm(self, pressure_kpa: float) -> float:
        """Return R_i [mm] at ΔP_i."""
        return float(_basis(np.array([pressure_kpa]))[0] @ self.quadratic.coefficients)

    def std_mm(self, pressure_kpa: float) -> float:
        """Return the standard uncertainty of R_i [mm] at ΔP_i."""
        x = _basis(np.array([pressure_kpa]))[0]
        return float(np.sqrt(x @ self.quadratic.covariance @ x))


def fit_radius(points: Points) -> RadiusFit:
    """Return the fit of the radius.

    Raises ConfigurationError if the points cannot come from a balloon, or if they do not determine the radius
    well enough. The message names the line of a wrong point.
    """
    points.require_rows(MIN_POINTS)
    pressure, radius = points["pressure_kpa"], radii_mm(points)
    _check_units(points, pressure, radius)
    _check_growth(points, pressure, radius)
    if np.ptp(pressure) < MIN_SPAN_KPA or len(set(pressure.round(1))) < MIN_POINTS // 2:
        raise points.error(
            f"the pressures span {np.ptp(pressure):.2f} kPa: at least {MIN_SPAN_KPA:g} kPa, and "
            f"{MIN_POINTS // 2} different pressures, are needed to fit a curve"
        )
    quadratic = fit_linear(_basis(pressure), radius)
    _check_rest_radius(points, float(quadratic.coefficients[0]))
    neo_hookean = fit_neo_hookean(pressure, radius, quadratic.coefficients[0])
    skin = fit_skin(pressure, radius)
    fit = RadiusFit(quadratic, neo_hookean, skin, _residual_mm(skin, pressure, radius), float(pressure.min()))
    _check_validated_range(points, fit)
    return fit


def _residual_mm(skin: RubberSkin, pressure_kpa: Numbers, radius_mm: Numbers) -> float:
    """Return the standard deviation of the radii [mm] from the curve of the skin.

    Pressures above the limit point of the skin are omitted.
    """
    residuals = radius_mm - skin.rest_radius_mm * skin.free_stretch(pressure_kpa)
    known = residuals[np.isfinite(residuals)]
    return float(np.sqrt((known**2).sum() / max(len(known) - FITTED_CONSTANTS, 1)))


def radii_mm(points: Points) -> Numbers:
    """Return the radii [mm]. Measured diameters are halved."""
    return points["radius_mm"] if _length_column(points) == "radius_mm" else points["diameter_mm"] / 2


def _length_column(points: Points) -> str:
    """Return the name of the column with the radii or diameters."""
    return "radius_mm" if "radius_mm" in points.columns else "diameter_mm"


def suspected_pressure_unit(pressure_kpa: Numbers) -> str:
    """Return the unit that the highest pressure suggests, or an empty text if the unit may be kPa."""
    highest = float(pressure_kpa.max())
    if highest > 1000.0:
        return "Pa"
    if highest > 50.0:
        return "hPa"
    return "bar or MPa" if highest < 0.5 else ""


def _basis(pressure_kpa: Numbers) -> Numbers:
    return np.stack([np.ones_like(pressure_kpa), pressure_kpa, pressure_kpa**2], axis=1)


def _check_units(points: Points, pressure_kpa: Numbers, radius_mm: Numbers) -> None:
    pressure_unit = suspected_pressure_unit(pressure_kpa)
    if pressure_unit:
        raise points.error(
            f"pressures up to {pressure_kpa.max():g} look like {pressure_unit}; they must be in kPa (gauge)"
        )
    if (pressure_kpa < 0).any():
        raise points.error("pressure_kpa is below 0", int(pressure_kpa.argmin()))
    median_mm, (low_mm, high_mm) = median(radius_mm.tolist()), RADIUS_RANGE_MM
    if not low_mm <= median_mm <= high_mm:
        unit = _suspected_length_unit(median_mm)
        reason = f"looks like {unit}: it must be in mm" if unit else "is not the radius of a balloon"
        raise points.error(f"a radius of {median_mm:g} {reason} ({low_mm:g} to {high_mm:g} mm)")


def _check_rest_radius(points: Points, rest_mm: float) -> None:
    """Raise ConfigurationError if R_0 is not that of a balloon, for example if diameters are called radii."""
    low_mm, high_mm = REST_RADIUS_RANGE_MM
    if low_mm <= rest_mm <= high_mm:
        return
    column, row = _length_column(points), int(points["pressure_kpa"].argmin())
    right, content, corrected_mm = {
        "radius_mm": ("diameter_mm", "diameters", rest_mm / 2),
        "diameter_mm": ("radius_mm", "radii", 2 * rest_mm),
    }[column]
    mixed_up = low_mm <= corrected_mm <= high_mm
    remedy = f"if these are {content}, name the column {right}" if mixed_up else "check the unit"
    raise points.error(
        f"{column} = {points[column][row]:g} at {points['pressure_kpa'][row]:g} kPa belongs to a balloon "
        f"with a radius of {rest_mm:.2f} mm at rest (allowed: {low_mm:g} to {high_mm:g} mm): {remedy}",
        row,
    )


def _suspected_length_unit(radius_mm: float) -> str:
    """Return the unit that a radius outside `RADIUS_RANGE_MM` suggests, or an empty text."""
    if radius_mm < 0.1:
        return "m"
    if radius_mm < RADIUS_RANGE_MM[0]:
        return "cm"
    return "µm" if radius_mm > 1e3 else ""


def _check_growth(points: Points, pressure_kpa: Numbers, radius_mm: Numbers) -> None:
    """Raise ConfigurationError if a radius is clearly smaller than a radius at a lower pressure."""
    order = np.argsort(pressure_kpa, kind="stable")
    highest = np.maximum.accumulate(radius_mm[order])
    falls = np.flatnonzero(radius_mm[order] < highest - MAX_FALL_MM)
    if len(falls):
        row = int(order[falls[0]])
        raise points.error(
            f"the radius {radius_mm[row]:.3f} mm at {pressure_kpa[row]:g} kPa is smaller than "
            f"{highest[falls[0]]:.3f} mm at a lower pressure: the caliper slipped, or the balloon "
            "is past its limit point",
            row,
        )


def _check_validated_range(points: Points, fit: RadiusFit) -> None:
    """Raise ConfigurationError if the fit is too uncertain or does not grow in the valid pressure range."""
    for pressure_kpa in (0.0, VALID_LOW_KPA, VALID_HIGH_KPA):
        std_mm = fit.std_mm(pressure_kpa)
        if not std_mm <= MAX_STD_MM:
            raise points.error(
                f"these points determine the radius at {pressure_kpa:g} kPa only to ±{std_mm:.2f} mm "
                f"({MAX_STD_MM:g} mm at most): measure over a wider span of pressures"
            )
    _, linear, quadratic = fit.quadratic.coefficients
    lowest_slope = min(linear + 2 * quadratic * kpa for kpa in (VALID_LOW_KPA, VALID_HIGH_KPA))
    if not lowest_slope > MIN_SLOPE_MM_PER_KPA:
        raise points.error(
            f"the fitted radius does not grow with the pressure from {VALID_LOW_KPA:g} to "
            f"{VALID_HIGH_KPA:g} kPa"
        )
