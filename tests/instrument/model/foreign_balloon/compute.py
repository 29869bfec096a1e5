"""Computation of both tables: `python -m tests.instrument.model.foreign_balloon.compute`.

The run takes about 25 minutes on one core. It needs `pip install -e '.[foreign-balloon]'`. With beginnings of
case names as arguments, for example `gent/8kPa`, only these cases are computed, and all other rows are kept.
"""

import csv
import sys
import time
from pathlib import Path

import numpy as np

from tests.instrument.model.foreign_balloon.balloon import ELEMENTS, LAYERS, half_balloon
from tests.instrument.model.foreign_balloon.cases import FORCES_N, FREE_PRESSURES_KPA, LAWS, cases
from tests.instrument.model.foreign_balloon.free import free_curve, inflate, scale_factors
from tests.instrument.model.foreign_balloon.gas import gas_law
from tests.instrument.model.foreign_balloon.materials import material
from tests.instrument.model.foreign_balloon.press import press

FOLDER = Path(__file__).parent
PRESSED, FREE = FOLDER / "pressed_balloons.csv", FOLDER / "free_radii.csv"
PRESSED_COLUMNS = (
    "case", "law", "sides", "friction", "gas_exponent",
    "baseline_kpa", "final_kpa", "force_n", "contact_radius_mm", "indentation_mm",
    "balloon_mm3",
)  # fmt: skip
FREE_COLUMNS = ("law", "pressure_kpa", "radius_mm", "mid_radius_mm")


def path_of(case, scale, curve, elements=ELEMENTS, layers=LAYERS, **options):
    """Return the path of a case up to the largest force.

    The rows are those of `press`, but with the volume of the whole balloon. The other arguments are options
    of `press`.
    """
    balloon = half_balloon(material(case.law, scale), elements, layers)
    inflate(balloon, case.baseline_kpa, step_kpa=1.0, max_growth=1.2)
    half_mm3 = balloon.half_volume_mm3()
    balloon.gas.lock(
        gas_law(case.baseline_kpa, half_mm3, case.sides, case.gas_exponent, curve.half_volume_mm3)
    )
    max_kpa = curve.max_kpa if case.sides == 1 else np.inf
    path = press(balloon, case.friction, FORCES_N[-1], max_kpa, **options)
    pressed_mm3 = path[:, 4]
    path[:, 4] += pressed_mm3 if case.sides == 2 else curve.half_volume_mm3(path[:, 1])
    return path


def at_forces(path, forces_n=FORCES_N):
    """Return the rows of a path at the forces that the path reaches, by linear interpolation."""
    reached = [force_n for force_n in forces_n if force_n <= path[-1, 0]]
    return np.column_stack([np.interp(reached, path[:, 0], column) for column in path.T])


def pressed_rows(case, scale, curve):
    """Return the rows of a case in the table of pressed balloons, and print the progress."""
    start_s = time.monotonic()
    path = path_of(case, scale, curve)
    condition = case.name, case.law, case.sides, case.friction, case.gas_exponent, case.baseline_kpa
    rows = []
    for force_n, pressure_kpa, radius_mm, indentation_mm, volume_mm3 in at_forces(path):
        lengths = f"{radius_mm:.4f}", f"{indentation_mm:.4f}", f"{volume_mm3:.3f}"
        rows.append((*condition, f"{pressure_kpa:.5f}", f"{force_n:g}", *lengths))
    print(
        f"{case.name}: {len(path)} steps to {path[-1, 0]:.2f} N and {path[-1, 1]:.2f} kPa "
        f"in {time.monotonic() - start_s:.0f} s",
        flush=True,
    )
    return rows


def free_rows(law, curve):
    """Return the rows of a law in the table of free balloons."""
    radii_mm = [(curve.outer_radius_mm(p), curve.mid_radius_mm(p)) for p in FREE_PRESSURES_KPA]
    return [
        (law, pressure_kpa, f"{outer_mm:.5f}", f"{mid_mm:.5f}")
        for pressure_kpa, (outer_mm, mid_mm) in zip(FREE_PRESSURES_KPA, radii_mm, strict=True)
    ]


def replace_rows(path, columns, order, rows):
    """Replace the rows of a table that have the same first column as new rows. `order`: all first columns."""
    old = []
    if path.exists():
        with path.open(encoding="utf-8", newline="") as file:
            old = list(csv.reader(file))[1:]
    replaced = {row[0] for row in rows}
    table = [row for row in old if row[0] not in replaced] + rows
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(sorted(table, key=lambda row: order.index(row[0])))


def main(beginnings):
    """Compute the cases whose names have one of the beginnings, and the free balloons of their laws."""
    scales = scale_factors(ELEMENTS, LAYERS)
    print("scale factors of the moduli:", {law: round(scale, 5) for law, scale in scales.items()}, flush=True)
    names = [case.name for law in LAWS for case in cases(law)]
    for law in LAWS:
        wanted = [case for case in cases(law) if case.name.startswith(tuple(beginnings))]
        if not wanted:
            continue
        curve = free_curve(material(law, scales[law]), ELEMENTS, LAYERS)
        print(f"{law}: {len(wanted)} cases; free balloon up to {curve.max_kpa:.2f} kPa", flush=True)
        replace_rows(FREE, FREE_COLUMNS, LAWS, free_rows(law, curve))
        for case in wanted:
            replace_rows(PRESSED, PRESSED_COLUMNS, names, pressed_rows(case, scales[law], curve))


if __name__ == "__main__":
    main(sys.argv[1:] or LAWS)
