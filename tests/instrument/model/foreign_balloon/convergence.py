"""Convergence study of the pressed balloons: `python -m tests.instrument.model.foreign_balloon.convergence`.

Each line repeats one case with one numerical parameter changed, and prints the rise of the pressure at a
few forces. The run takes about 5 minutes on one core.
"""

from functools import cache

from tests.instrument.model.foreign_balloon.balloon import ELEMENTS, LAYERS
from tests.instrument.model.foreign_balloon.cases import Case
from tests.instrument.model.foreign_balloon.compute import at_forces, path_of
from tests.instrument.model.foreign_balloon.free import free_curve
from tests.instrument.model.foreign_balloon.materials import material
from tests.instrument.model.foreign_balloon.press import CONTACT_STIFFNESS_MN_PER_MM, ELASTIC_SLIP_MM, STEP_MM

CASE = Case("mooney-rivlin", 8.0, 1, 0.2)
FORCES_N = (0.5, 1.0, 2.0, 3.5)
VARIANTS = {
    "as in the table": {},
    "elements along the meridian halved": {"elements": ELEMENTS // 2},
    "elements along the meridian doubled": {"elements": ELEMENTS * 2},
    "four layers in the wall": {"layers": 4},
    "steps halved": {"step_mm": STEP_MM / 2},
    "elastic slip halved": {"slip_mm": ELASTIC_SLIP_MM / 2},
    "contact four times stiffer": {"stiffness_mn_per_mm": 4 * CONTACT_STIFFNESS_MN_PER_MM},
    "friction 1": {"friction": 1.0},
    "friction infinite": {"friction": float("inf")},
}


@cache
def curve(elements, layers):
    """Return the free curve of the case for a mesh."""
    return free_curve(material(CASE.law), elements, layers)


def rises(elements=ELEMENTS, layers=LAYERS, friction=CASE.friction, **options):
    """Return the rises of the pressure in kPa, and the contact radii in mm, at `FORCES_N`."""
    case = Case(CASE.law, CASE.baseline_kpa, CASE.sides, friction)
    path = path_of(case, 1.0, curve(elements, layers), elements, layers, **options)
    rows = at_forces(path, FORCES_N)
    return rows[:, 1] - CASE.baseline_kpa, rows[:, 2]


def main():
    """Print a line per variant."""
    print(f"{CASE.name}: rise in kPa, and contact radius in mm, at {FORCES_N} N")
    for name, options in VARIANTS.items():
        rises_kpa, radii_mm = rises(**options)
        figures = [*(f"{rise:.4f}" for rise in rises_kpa), *(f"{radius:.3f}" for radius in radii_mm)]
        print(f"{name:40}", *figures, flush=True)


if __name__ == "__main__":
    main()
