"""Capacity of the pneumatic circuit: how much gas raises its pressure by 1 kPa."""

from __future__ import annotations

from pneuforce.instrument.model.balloon import Balloon, Circuit, sphere_volume_mm3

_STEP = 1e-30


def tubes_capacity_mm3_per_kpa(pressure_kpa: float, circuit: Circuit) -> float:
    """Return the capacity of the tubes alone, at a gauge pressure: V_c / (P_0 + ΔP).

    The gas volume is that at the pressure in the tubes.
    """
    return circuit.volume_mm3 / (circuit.ambient_kpa + pressure_kpa)


def capacity_mm3_per_kpa(pressure_kpa: float, balloon: Balloon, circuit: Circuit) -> float:
    """Return the capacity of tubes and free balloon, at a gauge pressure.

    The balloon takes gas up by compression, and also because it grows by its measured radius R_i(ΔP_i). The
    growth is an exact derivative (complex step).
    """
    balloon_mm3 = sphere_volume_mm3(balloon.radius_mm(complex(pressure_kpa, _STEP)))
    compression = balloon_mm3.real / (circuit.ambient_kpa + pressure_kpa)
    growth: float = balloon_mm3.imag / _STEP
    return float(tubes_capacity_mm3_per_kpa(pressure_kpa, circuit) + compression + growth)
