"""Mooney–Rivlin rubber skin, fitted to the measured radius curve of the free balloon.

The energy per area at rest is W = C1 (λ1² + λ2² + λ3² − 3) + C2 (λ1⁻² + λ2⁻² + λ3⁻² − 3) with
λ3 = 1/(λ1 λ2). C1 and C2 contain the thickness at rest, so the thickness itself is not needed.
Source: R. W. Ogden, *Non-Linear Elastic Deformations* (1984), sections 5.2 and 7.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.instrument.model.balloon import Balloon, sphere_volume_mm3

Floats = npt.NDArray[np.float64]

#: Pressures at which the radius curve is compared with that of the rubber [kPa].
FIT_PRESSURES_KPA = np.linspace(3.0, 12.0, 19)
#: Largest stretch of the free sphere. A balloon with this stretch is far beyond the measuring range.
MAX_STRETCH = 3.0
#: Bounds of the radius at rest, as shares of the smallest measured radius.
REST_RADIUS_SHARES = (0.85, 1.0)
#: Smallest growth of the radius that counts in a fit [mm/kPa].
MIN_SLOPE_MM_PER_KPA = 0.01
_NEWTON_STEPS, _STRETCH_TOLERANCE = 40, 1e-10


class EnergyDerivatives(NamedTuple):
    """First and second derivatives of the energy W with respect to the stretches λ1 and λ2 [kPa·mm]."""

    first: tuple[Any, Any]  #: ∂W/∂λ1, ∂W/∂λ2
    second: tuple[Any, Any, Any]  #: ∂²W/∂λ1², ∂²W/∂λ2², ∂²W/∂λ1∂λ2


@dataclass(frozen=True, slots=True)
class RubberSkin:
    """Constants of one skin, or arrays of constants of several skins."""

    rest_radius_mm: Any
    c1_kpa_mm: Any
    c2_kpa_mm: Any

    def energy_derivatives(self, along: Any, around: Any) -> EnergyDerivatives:
        """Return the derivatives of W at the stretches λ1 along the meridian and λ2 around the axis."""
        c1, c2 = self.c1_kpa_mm, self.c2_kpa_mm
        product = along * around
        i, j = 1 / (product * product), product * product
        first = (
            c1 * (2 * along - 2 * i / along) + c2 * (2 * j / along - 2 / along**3),
            c1 * (2 * around - 2 * i / around) + c2 * (2 * j / around - 2 / around**3),
        )
        second = (
            c1 * (2 + 6 * i / along**2) + c2 * (6 / along**4 + 2 * around**2),
            c1 * (2 + 6 * i / around**2) + c2 * (6 / around**4 + 2 * along**2),
            4 * (c1 * i / product + c2 * product),
        )
        return EnergyDerivatives(first, second)

    def free_kpa(self, stretch: Any) -> Any:
        """Return the pressure [kPa] of the free sphere: ΔP = (4/R_0)(λ⁻¹ − λ⁻⁷)(C1 + C2 λ²)."""
        shape = (1 / stretch - stretch**-7) * (self.c1_kpa_mm + self.c2_kpa_mm * stretch * stretch)
        return 4 / self.rest_radius_mm * shape

    def free_slope_kpa(self, stretch: Any) -> Any:
        """Return dΔP/dλ [kPa] of the free sphere. The slope is zero at the limit point."""
        shape, slope = 1 / stretch - stretch**-7, 7 * stretch**-8 - stretch**-2
        rubber = self.c1_kpa_mm + self.c2_kpa_mm * stretch * stretch
        return 4 / self.rest_radius_mm * (slope * rubber + shape * 2 * self.c2_kpa_mm * stretch)

    def free_stretch(self, pressure_kpa: Any) -> Any:
        """Return the stretch of the free sphere on its rising branch; NaN above the limit point."""
        stretch = 1.0 + 0.0 * pressure_kpa
        with np.errstate(all="ignore"):
            # From below, Newton's method rises monotonically to the root, because the curve is concave there.
            for _ in range(_NEWTON_STEPS):
                slope = self.free_slope_kpa(stretch)
                change = (pressure_kpa - self.free_kpa(stretch)) / slope
                stretch = np.where((slope > 0) & (stretch < MAX_STRETCH), stretch + change, np.nan)
                unsolved = np.abs(change) > _STRETCH_TOLERANCE
                if not unsolved.any():
                    break
            return np.where(unsolved, np.nan, stretch)

    def free_volume_mm3(self, pressure_kpa: Any) -> tuple[Any, Any]:
        """Return the volume of the free sphere [mm³] and its derivative with respect to the pressure."""
        stretch = self.free_stretch(pressure_kpa)
        volume = sphere_volume_mm3(self.rest_radius_mm * stretch)
        return volume, 3 * volume / (stretch * self.free_slope_kpa(stretch))


def skin_of(balloon: Balloon, radius_error_mm: float = 0.0) -> RubberSkin:
    """Return the skin of a balloon: the fitted constants, or the fit to its quadratic radius curve.

    The second fit keeps the radius at rest of the balloon.
    `radius_error_mm` is added to all inflated radii, so that the sensitivity to their error can be computed.
    """
    skin = balloon.skin
    if skin is None:
        radii = balloon.radius_mm(FIT_PRESSURES_KPA)
        fitted, _ = _fit_constants(FIT_PRESSURES_KPA, radii, balloon.rest_radius_mm)
    else:
        fitted = RubberSkin(skin.rest_radius_mm, skin.c1_kpa_mm, skin.c2_kpa_mm)
    if not radius_error_mm:
        return fitted
    radius = fitted.rest_radius_mm * fitted.free_stretch(FIT_PRESSURES_KPA)
    reached = np.isfinite(radius)
    return _fit_constants(
        FIT_PRESSURES_KPA[reached], radius[reached] + radius_error_mm, fitted.rest_radius_mm
    )[0]


def fit_skin(pressure_kpa: Floats, radius_mm: Floats) -> RubberSkin:
    """Return the skin whose free radius curve is closest to the measured radii.

    All three constants are fitted.
    """
    from scipy.optimize import minimize_scalar

    lowest, highest = REST_RADIUS_SHARES[0] * radius_mm.min(), REST_RADIUS_SHARES[1] * radius_mm.min()
    found = minimize_scalar(
        lambda rest_mm: _fit_constants(pressure_kpa, radius_mm, rest_mm)[1],
        bounds=(lowest, highest),
        method="bounded",
        options={"xatol": 1e-5},
    )
    return _fit_constants(pressure_kpa, radius_mm, float(found.x))[0]


def _fit_constants(
    pressure_kpa: Floats, radius_mm: Floats, rest_radius_mm: float
) -> tuple[RubberSkin, float]:
    """Return the skin with this radius at rest that fits best, and the norm of its residuals [mm].

    The pressure of the free sphere is linear in C1 and C2, which are fitted by least squares and are not
    negative. The weight dR/dΔP turns a residual of the pressure into a residual of the radius.
    """
    stretch = np.maximum(radius_mm / rest_radius_mm, 1.0)
    shape = 4 / rest_radius_mm * (1 / stretch - stretch**-7)
    slope = np.polyval(np.polyder(np.polyfit(pressure_kpa, radius_mm, 2)), pressure_kpa)
    weight = np.maximum(slope, MIN_SLOPE_MM_PER_KPA)
    basis = np.stack([shape, shape * stretch * stretch], axis=1) * weight[:, None]
    target = pressure_kpa * weight
    both = np.linalg.lstsq(basis, target, rcond=None)[0]
    alone = np.maximum(basis.T @ target / (basis * basis).sum(axis=0), 0.0)
    candidates = [both] if (both >= 0).all() else [alone * (1, 0), alone * (0, 1)]
    residual, c1, c2 = min((float(np.linalg.norm(basis @ found - target)), *found) for found in candidates)
    return RubberSkin(rest_radius_mm, float(c1), float(c2)), residual
