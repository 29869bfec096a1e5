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


def fit_rubber(balloon: Balloon, radius_error_mm: float = 0.0) -> RubberSkin:
    """Return the skin whose free radius curve is closest to that of the balloon.

    The pressure of the free sphere is linear in C1 and C2, which are fitted by least squares and are not
    negative. `radius_error_mm` is added to all inflated radii, so that the sensitivity to their error can be
    computed.
    """
    from scipy.optimize import nnls

    rest = balloon.rest_radius_mm
    stretch = (balloon.radius_mm(FIT_PRESSURES_KPA) + radius_error_mm) / rest
    shape = 4 / rest * (1 / stretch - stretch**-7)
    # An error of the radius, and not of the pressure, is minimised: the weight is dR/dΔP.
    weight = np.gradient(stretch, FIT_PRESSURES_KPA)
    basis = np.stack([shape, shape * stretch * stretch], axis=1) * weight[:, None]
    (c1, c2), _ = nnls(basis, FIT_PRESSURES_KPA * weight)
    return RubberSkin(rest, float(c1), float(c2))
