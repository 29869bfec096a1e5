"""Free inflation of the balloons of all laws: radius and volume over pressure."""

from dataclasses import dataclass

import felupe as fem
import numpy as np
from scipy.interpolate import PchipInterpolator

from tests.instrument.model.foreign_balloon.balloon import half_balloon
from tests.instrument.model.foreign_balloon.cases import LAWS
from tests.instrument.model.foreign_balloon.materials import material

STEP_KPA, MIN_STEP_KPA, MAX_KPA = 0.1, 0.003, 17.0
#: Largest ratio of the volumes at two successive pressures. A larger one is a jump beyond the limit point.
MAX_GROWTH = 1.03
#: Pressure at which all laws have the same radius.
COMMON_KPA = 8.0


@dataclass
class FreeCurve:
    """Free balloon over pressure: radii in mm, and half the volume in mm³, each as a function of kPa."""

    max_kpa: float
    outer_radius_mm: PchipInterpolator
    mid_radius_mm: PchipInterpolator
    half_volume_mm3: PchipInterpolator


def inflate(balloon, max_kpa, step_kpa=STEP_KPA, max_growth=MAX_GROWTH):
    """Inflate a free balloon in steps, and leave the balloon at the last pressure.

    Return a row per pressure: pressure in kPa, outer radius and mid-surface radius in mm, half the volume in
    mm³. The last pressure is `max_kpa`, or a pressure just below the limit point, beyond which no
    equilibrium exists.
    """
    rows = [(0.0, *balloon.equator_mm(), balloon.half_volume_mm3())]
    while rows[-1][0] < max_kpa and step_kpa >= MIN_STEP_KPA:
        before_mm = balloon.displacements_mm()
        pressure_kpa = rows[-1][0] + step_kpa
        if pressure_kpa > max_kpa - MIN_STEP_KPA:
            pressure_kpa = max_kpa
        balloon.gas.prescribe(pressure_kpa)
        try:
            balloon.solve()
            found = balloon.half_volume_mm3() <= max_growth * rows[-1][-1]
        except fem.NewtonConvergenceError:
            found = False
        if found:
            rows.append((pressure_kpa, *balloon.equator_mm(), balloon.half_volume_mm3()))
        else:
            balloon.restore(before_mm)
            step_kpa /= 2
    return np.array(rows)


def free_curve(material, elements, layers, max_kpa=MAX_KPA):
    """Return the free curve of a material, up to its limit point or to a pressure."""
    rows = inflate(half_balloon(material, elements, layers), max_kpa)
    # The solution of the gas law needs a volume at each pressure. Paths end at the limit point.
    slope = (rows[-1] - rows[-2]) / (rows[-1, 0] - rows[-2, 0])
    pressures_kpa, *columns = np.vstack([rows, rows[-1] + slope * MAX_KPA]).T
    return FreeCurve(rows[-1, 0], *(PchipInterpolator(pressures_kpa, column) for column in columns))


def scale_factors(elements, layers):
    """Return the factor for the moduli of each law that gives all laws one radius at `COMMON_KPA`.

    The pressure of a free balloon at a given radius is proportional to the moduli.
    """
    curves = {law: free_curve(material(law), elements, layers, max_kpa=COMMON_KPA + 1) for law in LAWS}
    common_mm = curves[LAWS[0]].mid_radius_mm(COMMON_KPA)
    pressures_kpa = {
        law: float(curve.mid_radius_mm.solve(common_mm, extrapolate=False)[0])
        for law, curve in curves.items()
    }
    return {law: COMMON_KPA / pressure_kpa for law, pressure_kpa in pressures_kpa.items()}
