"""The rubber that the paper's measured radius identifies, and the energy that its tensions come from."""

import numpy as np

from sim.membrane.material import Rubber

#: The paper's inflation pressures [kPa], at which its Fig. 4 was measured.
MEASURED_KPA = np.linspace(4.95, 11.45, 27)


def measured_radius_mm(pressure_kpa):
    """R_i [mm], the quadratic of the paper's Fig. 4: all that is known of the real balloon's skin."""
    return Rubber().radius_mm + (5.9695 * pressure_kpa + 44.652) * pressure_kpa * 1e-3


def identify(alpha_too):
    """The rubber whose free inflation lies closest to the paper's 27 inflation pressures, by least squares.

    ΔP is linear in μ and μα. Neo-Hookean without `alpha_too`.
    """
    stretch = measured_radius_mm(MEASURED_KPA) / Rubber().radius_mm
    parts = [Rubber(mu_kpa=1.0, alpha=0.0).free_kpa(stretch)]
    if alpha_too:
        parts.append(parts[0] * stretch**2)
    mu_kpa, *rest = np.linalg.lstsq(np.stack(parts, axis=1), MEASURED_KPA)[0]
    return Rubber(mu_kpa=float(mu_kpa), alpha=float(rest[0] / mu_kpa) if rest else 0.0)


def energy_kpa_mm(rubber, along, around):
    """Energy per area at rest, W·h₀ [kPa·mm], at the stretches along the meridian and around the axis."""
    a, b = along * along, around * around
    first = a + b + 1 / (a * b) - 3
    second = 1 / a + 1 / b + a * b - 3
    return 0.5 * rubber.mu_kpa * rubber.thickness_mm * (first + rubber.alpha * second)
