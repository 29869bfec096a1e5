"""Gas in balloon and tubes as an item of felupe: a pressure that follows from the volume of the balloon."""

import felupe as fem
import numpy as np
from scipy.optimize import brentq
from scipy.sparse import csr_matrix

AMBIENT_KPA, CIRCUIT_MM3 = 101.325, 12_680.0


def half_volume_mm3(positions_mm):
    """Return the volume inside a half balloon from its inner points, as a sum of truncated cones."""
    x, r = positions_mm.T
    return np.pi / 3 * np.sum(np.diff(x) * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2))


class LockedGas(fem.SolidBodyPressure):
    """Pressure on the inner surface. The pressure is prescribed, or follows from the law of a locked gas.

    The law is (P_0 + ΔP)(V_c + V_balloon)ⁿ = constant. The stiffness of the gas is a part of the stiffness
    matrix, so that the Newton method finds shape and pressure together.
    """

    def __init__(self, field, inner):
        super().__init__(field)
        self._points_mm = field.region.mesh.points[inner]
        self._inner = inner
        self._law = None
        self.pressure_kpa = 0.0

    def prescribe(self, pressure_kpa):
        """Set a pressure that does not depend on the volume."""
        self._law, self.pressure_kpa = None, pressure_kpa

    def lock(self, law):
        """Let the pressure follow from `law`, a function that returns (ΔP, dΔP/dV) in kPa for V in mm³."""
        self._law = law

    def _vector(self, field=None, pressure=None, **options):
        if field is not None:
            self._update(field)
        slope = 0.0
        if self._law:
            positions_mm = self._points_mm + self.field[0].values[self._inner]
            self.pressure_kpa, slope = self._law(half_volume_mm3(positions_mm))
        force = super()._vector(field, pressure=1.0, **options).copy()
        self._slope_kpa_per_mm3, self._volume_gradient = slope, force
        return csr_matrix(self.pressure_kpa * force)

    def _matrix(self, field=None, pressure=None, **options):
        stiffness = super()._matrix(field, pressure=self.pressure_kpa, **options)
        gradient = self._volume_gradient
        return stiffness + self._slope_kpa_per_mm3 * (gradient @ gradient.T)


def gas_law(baseline_kpa, half_mm3, sides, exponent, free_half_mm3):
    """Return the law of the gas that is locked at the baseline pressure, for `LockedGas.lock`.

    `half_mm3` is the volume of a half balloon at the baseline, and `free_half_mm3` is a differentiable
    function that returns the volume of a free half balloon at a pressure. One-sided: the other half of the
    balloon is free.
    """
    total_mm3 = CIRCUIT_MM3 + 2 * half_mm3
    product = (AMBIENT_KPA + baseline_kpa) * total_mm3**exponent
    free_slope = free_half_mm3.derivative()

    def two_sided(volume_mm3):
        total = CIRCUIT_MM3 + 2 * volume_mm3
        pressure_kpa = product / total**exponent - AMBIENT_KPA
        return pressure_kpa, -2 * exponent * (AMBIENT_KPA + pressure_kpa) / total

    def one_sided(volume_mm3):
        def excess(pressure_kpa):
            total = CIRCUIT_MM3 + volume_mm3 + free_half_mm3(pressure_kpa)
            return (AMBIENT_KPA + pressure_kpa) * total**exponent / product - 1

        pressure_kpa = brentq(excess, 0, 30, xtol=1e-12)
        total = CIRCUIT_MM3 + volume_mm3 + free_half_mm3(pressure_kpa)
        slope = exponent * (AMBIENT_KPA + pressure_kpa) / total
        return pressure_kpa, -slope / (1 + slope * free_slope(pressure_kpa))

    return two_sided if sides == 2 else one_sided
