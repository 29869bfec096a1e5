"""Free inflation of the balloons of all laws: radius and volume over pressure."""

from dataclasses import dataclass

import felupe as fem
import numpy as np
from scipy.interpolate import PchipInterpolator

from tests.instrument.model.foreign_balloon.balloon import half_balloon
from tests.instrument.model.foreign_balloon.cases import LAWS
from tests.instrument.model.foreign_balloon.materials import material

STEP_KPA, MAX_KPA = 0.1, 17.0
#: Pressure at which all laws have the same radius.
COMMON_KPA = 8.0
#: A larger ratio of the volumes at two pressures is a jump beyond the limit point.
MAX_GROWTH = 1.2


@dataclass
class FreeCurve:
    """Free balloon over pressure: radii in mm, and half the volume in mm³, each as a function of kPa."""

    max_kpa: float
    outer_radius_mm: PchipInterpolator
    mid_radius_mm: PchipInterpolator
    half_volume_mm3: PchipInterpolator


def inflate(balloon, pressures_kpa):
    """Inflate a free balloon through increasing pressures, and leave the balloon at the last one.

    Return a row per pressure: pressure in kPa, outer radius and mid-surface radius in mm, half the volume
    in mm³. The rows end before the first pressure without equilibrium (limit point).
    """
    rows = [(0.0, *balloon.equator_mm(), balloon.half_volume_mm3())]
    for pressure_kpa in pressures_kpa:
        balloon.gas.prescribe(pressure_kpa)
        try:
            balloon.solve()
        except fem.NewtonConvergenceError:
            break
        if balloon.half_volume_mm3() > MAX_GROWTH * rows[-1][-1]:
            break
        rows.append((pressure_kpa, *balloon.equator_mm(), balloon.half_volume_mm3()))
    return np.array(rows)


def free_curve(material, elements, layers):
    """Return the free curve of a material, up to its limit point or to `MAX_KPA`."""
    rows = inflate(half_balloon(material, elements, layers), np.arange(STEP_KPA, MAX_KPA, STEP_KPA))
    # The solution of the gas law needs a volume at each pressure. Paths end at the limit point.
    beyond = rows[-1] + (rows[-1] - rows[-2]) * 500
    pressures_kpa, *columns = np.vstack([rows, beyond]).T
    return FreeCurve(rows[-1, 0], *(PchipInterpolator(pressures_kpa, column) for column in columns))


def scale_factors(elements, layers):
    """Return the factor for the moduli of each law that gives all laws one radius at `COMMON_KPA`.

    The pressure of a free balloon at a given radius is proportional to the moduli.
    """
    curves = {law: free_curve(material(law), elements, layers) for law in LAWS}
    common_mm = curves[LAWS[0]].mid_radius_mm(COMMON_KPA)
    pressures_kpa = {
        law: float(curve.mid_radius_mm.solve(common_mm, extrapolate=False)[0])
        for law, curve in curves.items()
    }
    return {law: COMMON_KPA / pressure_kpa for law, pressure_kpa in pressures_kpa.items()}
