"""Rubber parameters identified from the radius measured in the paper, and the strain energy of a rubber."""

import numpy as np

from pneuforce.sim.plants.membrane.material import Rubber

#: Inflation pressures of Fig. 4 of the paper [kPa].
MEASURED_KPA = np.linspace(4.95, 11.45, 27)


def measured_radius_mm(pressure_kpa):
    """Return R_i [mm] from the quadratic polynomial in Fig. 4 of the paper.

    No other property of the real skin is known.
    """
    return Rubber().radius_mm + (5.9695 * pressure_kpa + 44.652) * pressure_kpa * 1e-3


def identify(fit_alpha):
    """Return the rubber whose free inflation fits the 27 inflation pressures of the paper by least squares.

    ΔP is linear in μ and μα. Without `fit_alpha`, the rubber is neo-Hookean.
    """
    stretch = measured_radius_mm(MEASURED_KPA) / Rubber().radius_mm
    parts = [Rubber(mu_kpa=1.0, alpha=0.0).free_kpa(stretch)]
    if fit_alpha:
        parts.append(parts[0] * stretch**2)
    mu_kpa, *rest = np.linalg.lstsq(np.stack(parts, axis=1), MEASURED_KPA)[0]
    return Rubber(mu_kpa=float(mu_kpa), alpha=float(rest[0] / mu_kpa) if rest else 0.0)


def energy_kpa_mm(rubber, along, around):
    """Return the energy per area at rest, W·h₀ [kPa·mm]: stretches along the meridian and around the axis."""
    a, b = along * along, around * around
    first = a + b + 1 / (a * b) - 3
    second = 1 / a + 1 / b + a * b - 3
    return 0.5 * rubber.mu_kpa * rubber.thickness_mm * (first + rubber.alpha * second)
