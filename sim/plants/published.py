"""The `published` plant: a balloon that follows the energetic law of Gaudeni & Prattichizzo exactly.

The free balloon has the radius of Fig. 4 of the paper. A pressed balloon has the pressure at which the
energetic law gives the force. Below a rise of 0.5 kPa, the force falls to zero on a line or a smooth curve.
Force and indentation are tabulated once as functions of the baseline pressure ΔP_i and the rise.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np

from pneuforce.instrument.model import Balloon, Circuit, ForceLaw, estimate
from pneuforce.instrument.model.balloon import MIN_RISE_KPA, sphere_volume_mm3
from pneuforce.instrument.model.law import Low
from pneuforce.sim.plants.plant import BalloonState, Gas

MIN_FREE_KPA, MAX_FREE_KPA = -3.7, 40.0  # range in which the quadratic of Fig. 4 increases
START_KPA = 6.0
#: Newton's method doubles the number of correct digits in each step. After a step below 1e-3 kPa, the error
#: is below 1e-7 kPa.
TOLERANCE_KPA, MAX_ITERATIONS = 1e-3, 50
FOUR_PI = 4 * math.pi
#: Range and step of the baseline pressure in the table.
BASELINE_STEP_KPA = 0.1
MIN_BASELINE_KPA = 0.5
MAX_BASELINE_KPA = 18.0
#: Highest rise in the table [kPa]. A larger force does not increase the rise further.
MAX_RISE_KPA = 16.0
RISES_KPA: list[float] = np.concatenate(
    [
        MIN_RISE_KPA
        * np.linspace(0, 1, 16)[:-1] ** 2,  # dense near 0, because the smooth curve starts as √rise
        np.linspace(MIN_RISE_KPA, MAX_RISE_KPA, 156),
    ]
).tolist()


class _LawTable:
    """Table of force and indentation by ΔP_i and rise, for one of the two stretching energies."""

    def __init__(
        self, low_kpa: float, high_kpa: float, balloon: Balloon, circuit: Circuit, law: ForceLaw
    ) -> None:
        count = math.ceil((high_kpa - low_kpa) / BASELINE_STEP_KPA) + 1
        baselines = np.linspace(low_kpa, high_kpa, count)
        solved = estimate(baselines[:, None], baselines[:, None] + np.array(RISES_KPA), balloon, circuit, law)
        self.low_kpa, self.step_kpa = low_kpa, float(baselines[1] - baselines[0])
        self.forces_n = [_finite_part(row) for row in solved.force_n]
        self.indentations_mm = solved.indentation_mm.tolist()

    def press(self, baseline_kpa: float, force_n: float) -> tuple[float, float, float]:
        """Return rise [kPa], indentation [mm] and force [N]. The table limits the force."""
        row, w = self._row_at(baseline_kpa)
        low, high = self.forces_n[row], self.forces_n[row + 1]

        def force(column: int) -> float:
            return low[column] + w * (high[column] - low[column])

        right = _column(low, high, force_n, force)
        left = right - 1
        f0, f1 = force(left), force(right)
        fraction = (force_n - f0) / (f1 - f0) if force_n < f1 else 1.0
        d_low, d_high = self.indentations_mm[row], self.indentations_mm[row + 1]
        d0 = d_low[left] + w * (d_high[left] - d_low[left])
        d1 = d_low[right] + w * (d_high[right] - d_low[right])
        rise = RISES_KPA[left] + fraction * (RISES_KPA[right] - RISES_KPA[left])
        return rise, d0 + fraction * (d1 - d0), f0 + fraction * (f1 - f0)

    def _row_at(self, baseline_kpa: float) -> tuple[int, float]:
        """Return the row below ΔP_i, and the interpolation weight of the next row."""
        position = (baseline_kpa - self.low_kpa) / self.step_kpa
        if position <= 0:
            return 0, 0.0
        row = int(position)
        last = len(self.forces_n) - 2
        return (row, position - row) if row <= last else (last, 1.0)


def _column(low: list[float], high: list[float], force_n: float, force: Callable[[int], float]) -> int:
    """Return the first column from column 1 on whose force, interpolated between two rows, reaches `force_n`.

    This column lies between the columns at which the two rows reach that force. Therefore, only two or
    three columns are searched.
    """
    last = min(len(low), len(high)) - 1
    in_low, in_high = bisect_left(low, force_n, 0, last), bisect_left(high, force_n, 0, last)
    first, end = (in_low, in_high) if in_low < in_high else (in_high, in_low)
    return bisect_left(range(last), force_n, first, end, key=force) or 1


def _finite_part(forces_n: np.ndarray) -> list[float]:
    """Return the part of a row in which the law has a root. The force must increase in this part."""
    row: list[float] = forces_n[np.isfinite(forces_n)].tolist()
    assert all(b > a for a, b in pairwise(row))
    return row


@cache
def _law_tables(balloon: Balloon, circuit: Circuit, law: ForceLaw) -> tuple[_LawTable, _LawTable]:
    """Return the tables below and above the switch pressure. Equal balloons share them."""
    switch_kpa = balloon.switch_kpa
    above_kpa = math.nextafter(switch_kpa, math.inf)
    return (
        _LawTable(MIN_BASELINE_KPA, switch_kpa, balloon, circuit, law),
        _LawTable(above_kpa, MAX_BASELINE_KPA, balloon, circuit, law),
    )


class PublishedPlant:
    """Balloon of the paper. The first construction takes about 0.1 s, and each step some microseconds.

    The law is tabulated for the volume and ambient pressure of `circuit`. For any other gas, the table is
    read at the pressure that this gas has without contact.
    """

    def __init__(
        self, balloon: Balloon | None = None, circuit: Circuit | None = None, low: Low = "line"
    ) -> None:
        """Tabulate the law. `low` selects the form of the law below a rise of 0.5 kPa (see `ForceLaw`)."""
        law = ForceLaw(low=low)
        self.balloon = balloon or Balloon()
        self.circuit = circuit or Circuit()
        self._radius = (
            self.balloon.rest_radius_mm,
            self.balloon.radius_linear_mm_per_kpa,
            self.balloon.radius_quadratic_mm_per_kpa2,
        )
        self._below_switch, self._above_switch = _law_tables(self.balloon, self.circuit, law)

    def radius_mm(self, pressure_kpa: float) -> float:
        """Return the radius R_i [mm] of the free balloon from the quadratic of Fig. 4."""
        radius: float = self.balloon.radius_mm(pressure_kpa)
        return radius

    def settle(self, gas: Gas, force_n: float) -> BalloonState:
        """Return the equilibrium with this gas under this force [N]."""
        baseline_kpa = self._baseline_kpa(gas)
        rise_kpa, indentation_mm, contact_radius_mm = 0.0, 0.0, 0.0
        if force_n > 0:
            rise_kpa, indentation_mm, carried_n = self._press(baseline_kpa, force_n)
            radius_mm = self.radius_mm(baseline_kpa)
            contact_radius_mm = _contact_radius(carried_n, baseline_kpa + rise_kpa, radius_mm)
        final_kpa = baseline_kpa + rise_kpa
        volume = gas.amount_kpa_mm3 / (gas.outside_kpa + final_kpa) - gas.tubes_mm3
        return BalloonState(final_kpa, indentation_mm, contact_radius_mm, volume)

    def _baseline_kpa(self, gas: Gas) -> float:
        """Return the pressure [kPa] of this gas without contact, by Newton's method.

        p·V is a convex function of p: from the second step on, all iterates approach the root from above.
        Outside the range of the quadratic, the balloon keeps its volume.
        """
        amount, tubes, outside = gas
        rest, linear, quadratic = self._radius
        pressure = START_KPA
        for _ in range(MAX_ITERATIONS):
            bend = quadratic * pressure
            radius = rest + (bend + linear) * pressure
            area = FOUR_PI * radius * radius
            volume = tubes + area * radius / 3
            absolute = outside + pressure
            step = (absolute * volume - amount) / (volume + absolute * area * (bend + bend + linear))
            pressure -= step
            if pressure < MIN_FREE_KPA:
                return self._rigid_kpa(gas, MIN_FREE_KPA)
            if -TOLERANCE_KPA < step < TOLERANCE_KPA:
                break
        return pressure if pressure <= MAX_FREE_KPA else self._rigid_kpa(gas, MAX_FREE_KPA)

    def _rigid_kpa(self, gas: Gas, free_kpa: float) -> float:
        """Return the pressure [kPa] of this gas if the balloon keeps its volume at `free_kpa`."""
        volume_mm3: float = sphere_volume_mm3(self.radius_mm(free_kpa))
        return gas.amount_kpa_mm3 / (gas.tubes_mm3 + volume_mm3) - gas.outside_kpa

    def _press(self, baseline_kpa: float, force_n: float) -> tuple[float, float, float]:
        """Return the rise [kPa], the indentation [mm] and the force [N] that the balloon can carry.

        If ΔP_i is below the range of the table, the rise is proportional to ΔP_i, because a contact does not
        raise the pressure of an empty balloon.
        """
        table = self._above_switch if baseline_kpa > self.balloon.switch_kpa else self._below_switch
        rise_kpa, indentation_mm, carried_n = table.press(baseline_kpa, force_n)
        if baseline_kpa < MIN_BASELINE_KPA:
            rise_kpa *= max(baseline_kpa, 0.0) / MIN_BASELINE_KPA
        return rise_kpa, indentation_mm, carried_n


def _contact_radius(force_n: float, pressure_kpa: float, radius_mm: float) -> float:
    """Return the contact radius a [mm] from F = ΔP_f π a², eq. (1), at most the radius of a flat balloon."""
    flat_mm = math.pi / 2 * radius_mm
    if not pressure_kpa > 0:
        return flat_mm
    return min(math.sqrt(force_n * 1e3 / (math.pi * pressure_kpa)), flat_mm)
