"""Rubber parameters identified from the radius measured in the paper, and the strain energy of a rubber."""

from dataclasses import replace

import numpy as np

from pneuforce.sim.plants.membrane.material import MOONEY_RIVLIN, Gent, MooneyRivlin, Ogden

#: Inflation pressures of Fig. 4 of the paper [kPa].
MEASURED_KPA = np.linspace(4.95, 11.45, 27)


def measured_radius_mm(pressure_kpa):
    """Return R_i [mm] from the quadratic polynomial in Fig. 4 of the paper.

    No other property of the real skin is known.
    """
    return MOONEY_RIVLIN.radius_mm + (5.9695 * pressure_kpa + 44.652) * pressure_kpa * 1e-3


def identify(rubber):
    """Return the rubber whose free inflation fits the 27 inflation pressures of the paper by least squares.

    ΔP is linear in μ. For Mooney–Rivlin, ΔP is linear in μ and μα. With α = 0, only μ is fitted.
    """
    stretch = measured_radius_mm(MEASURED_KPA) / rubber.radius_mm
    alpha = getattr(rubber, "alpha", 0.0)
    parts = [replace(rubber, mu_kpa=1.0, **({"alpha": 0.0} if alpha else {})).free_kpa(stretch)]
    if alpha:
        parts.append(parts[0] * stretch**2)
    mu_kpa, *rest = map(float, np.linalg.lstsq(np.stack(parts, axis=1), MEASURED_KPA)[0])
    return replace(rubber, mu_kpa=mu_kpa, **({"alpha": rest[0] / mu_kpa} if alpha else {}))


def energy_kpa_mm(rubber, along, around):
    """Return the energy per area at rest, W·h₀ [kPa·mm]: stretches along the meridian and around the axis."""
    a, b, c = along * along, around * around, 1 / (along * around) ** 2
    first, second = a + b + c - 3, 1 / a + 1 / b + 1 / c - 3
    match rubber:
        case MooneyRivlin():
            energy = 0.5 * (first + rubber.alpha * second)
        case Gent():
            energy = -0.5 * rubber.locking * np.log(1 - first / rubber.locking)
        case Ogden():
            terms = zip(rubber.exponents, rubber.ratios, strict=True)
            energy = sum(r / p * (along**p + around**p + (along * around) ** -p - 3) for p, r in terms)
    return rubber.mu_kpa * rubber.thickness_mm * energy
