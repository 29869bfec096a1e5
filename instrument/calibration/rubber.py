"""Neo-Hookean rubber balloon: ΔP = (2 μh_0/R_0)(λ⁻¹ − λ⁻⁷), a curve with a highest pressure.

The highest pressure is the limit point, at the stretch λ = 7^(1/6). Beyond the limit point the balloon grows
while its pressure falls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneuforce.support.columns import Numbers

LIMIT_STRETCH = 7 ** (1 / 6)
LIMIT_PRESSURE_RATIO = 1 / LIMIT_STRETCH - LIMIT_STRETCH**-7  #: ratio of the limit pressure to 2 μh_0/R_0
#: Highest recommended setpoint, as a share of the limit pressure.
MAX_SETPOINT_RATIO = 0.9
_STRETCHES = np.linspace(1.0, LIMIT_STRETCH, 2001)
_PRESSURE_RATIOS = 1 / _STRETCHES - _STRETCHES**-7


@dataclass(frozen=True, slots=True)
class NeoHookeanFit:
    """Neo-Hookean curve fitted to measured radii."""

    shear_kpa_mm: float  #: shear modulus times wall thickness at rest, μh_0
    limit_kpa: float
    limit_std_kpa: float
    residual_mm: float  #: standard deviation of the radii from the curve

    def limit_warning(self, highest_setpoint_kpa: float) -> str:
        """Return a warning if setpoints come near the limit point, otherwise an empty text."""
        recommended_kpa = MAX_SETPOINT_RATIO * self.limit_kpa
        if highest_setpoint_kpa <= recommended_kpa:
            return ""
        return (
            f"the inflation limit of this balloon is near {self.limit_kpa:.2f} ± {self.limit_std_kpa:.2f} "
            f"kPa: keep setpoints below {recommended_kpa:.2f} kPa (up to {highest_setpoint_kpa:g} kPa are "
            "accepted)"
        )


def fit_neo_hookean(pressure_kpa: Numbers, radius_mm: Numbers, rest_radius_mm: float) -> NeoHookeanFit:
    """Return the neo-Hookean curve that fits the radii best.

    `rest_radius_mm` is the start value for R_0. The fit varies R_0 and the pressure scale 2 μh_0/R_0.
    """
    from scipy.optimize import curve_fit

    start = (rest_radius_mm, float(pressure_kpa.max()) / LIMIT_PRESSURE_RATIO)
    bounds = ([0.1, 1e-3], [100.0, 1e4])
    (rest_mm, scale_kpa), covariance = curve_fit(
        free_radius_mm, pressure_kpa, radius_mm, np.clip(start, *bounds), bounds=bounds
    )
    residuals = radius_mm - free_radius_mm(pressure_kpa, rest_mm, scale_kpa)
    return NeoHookeanFit(
        float(scale_kpa * rest_mm / 2),
        float(LIMIT_PRESSURE_RATIO * scale_kpa),
        float(LIMIT_PRESSURE_RATIO * np.sqrt(covariance[1, 1])),
        float(np.sqrt((residuals**2).sum() / (len(residuals) - 2))),
    )


def free_radius_mm(pressure_kpa: Numbers, rest_radius_mm: float, scale_kpa: float) -> Numbers:
    """Return the radius of the free balloon [mm] at each pressure. `scale_kpa` is 2 μh_0/R_0.

    Above the limit pressure the radius is that of the limit point.
    """
    radii: Numbers = rest_radius_mm * np.interp(pressure_kpa, scale_kpa * _PRESSURE_RATIOS, _STRETCHES)
    return radii
