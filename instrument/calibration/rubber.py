"""A balloon of neo-Hookean rubber: ΔP = (2 μh_0/R_0)(λ⁻¹ − λ⁻⁷), which has a highest pressure.

That is the limit point, at the stretch λ = 7^(1/6): beyond it the balloon grows while its pressure falls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from instrument.columns import Numbers

LIMIT_STRETCH = 7 ** (1 / 6)
LIMIT_SHARE = 1 / LIMIT_STRETCH - LIMIT_STRETCH**-7  #: limit pressure over 2 μh_0/R_0
#: A setpoint above this share of the limit pressure is too near to it.
NEAR = 0.9
_STRETCHES = np.linspace(1.0, LIMIT_STRETCH, 2001)
_SHARES = 1 / _STRETCHES - _STRETCHES**-7


@dataclass(frozen=True, slots=True)
class Rubber:
    """What the rubber's curve says of the measured radii."""

    shear_kpa_mm: float  #: μ h_0
    limit_kpa: float
    limit_std_kpa: float
    residual_mm: float  #: how well this curve goes through the points

    def warning(self, highest_setpoint_kpa: float) -> str:
        """A sentence where setpoints come near the limit point, else empty."""
        near_kpa = NEAR * self.limit_kpa
        if highest_setpoint_kpa <= near_kpa:
            return ""
        return (
            f"the inflation limit of this balloon is near {self.limit_kpa:.2f} ± {self.limit_std_kpa:.2f} "
            f"kPa: keep setpoints below {near_kpa:.2f} kPa (up to {highest_setpoint_kpa:g} kPa are accepted)"
        )


def rubber_of(pressure_kpa: Numbers, radius_mm: Numbers, rest_radius_mm: float) -> Rubber:
    """The rubber whose curve comes nearest to these radii; its own R_0 is found with it."""
    from scipy.optimize import curve_fit

    start = (rest_radius_mm, float(pressure_kpa.max()) / LIMIT_SHARE)
    bounds = ([0.1, 1e-3], [100.0, 1e4])
    (rest_mm, scale_kpa), covariance = curve_fit(
        free_radius_mm, pressure_kpa, radius_mm, np.clip(start, *bounds), bounds=bounds
    )
    residuals = radius_mm - free_radius_mm(pressure_kpa, rest_mm, scale_kpa)
    return Rubber(
        float(scale_kpa * rest_mm / 2),
        float(LIMIT_SHARE * scale_kpa),
        float(LIMIT_SHARE * np.sqrt(covariance[1, 1])),
        float(np.sqrt((residuals**2).sum() / (len(residuals) - 2))),
    )


def free_radius_mm(pressure_kpa: Numbers, rest_radius_mm: float, scale_kpa: float) -> Numbers:
    """Radius [mm] below the limit point, where `scale_kpa` is 2 μh_0/R_0; above it, that of the limit."""
    radii: Numbers = rest_radius_mm * np.interp(pressure_kpa, scale_kpa * _SHARES, _STRETCHES)
    return radii
