"""The `published` plant: a balloon that obeys the energetic law of Gaudeni & Prattichizzo to the letter.

Free, it has the radius of their Fig. 4. Pressed, its pressure rises until the energetic law gives the force;
below a rise of 0.5 kPa force and rise are proportional, or joined smoothly. The law is tabulated once over
(ΔP_i, rise).
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np

from instrument.model import Balloon, Circuit, Law, estimate
from instrument.model.balloon import LOWEST_RISE_KPA, sphere_volume
from instrument.model.law import Low
from sim.plant import BalloonState, Gas

LOWEST_FREE_KPA, HIGHEST_FREE_KPA = -3.7, 40.0  # where the quadratic of Fig. 4 rises
MIDDLE_KPA = 6.0
#: Newton doubles the digits with each step: after one that is this short the rest is below 1e-7 kPa.
CLOSE_KPA, MOST_STEPS = 1e-3, 50
FOUR_PI = 4 * math.pi
INITIAL_STEP_KPA = 0.1
LOWEST_INITIAL_KPA = 0.5
HIGHEST_INITIAL_KPA = 18.0
#: A harder push than this rise does not raise the pressure further.
HIGHEST_RISE_KPA = 16.0
RISES_KPA: list[float] = np.concatenate(
    [
        LOWEST_RISE_KPA
        * np.linspace(0, 1, 16)[:-1] ** 2,  # dense where a smooth join begins like a square root
        np.linspace(LOWEST_RISE_KPA, HIGHEST_RISE_KPA, 156),
    ]
).tolist()


class _Sheet:
    """The law on one side of the switch of stretching energies: force and indentation by ΔP_i and rise."""

    def __init__(self, low_kpa: float, high_kpa: float, balloon: Balloon, circuit: Circuit, law: Law) -> None:
        count = math.ceil((high_kpa - low_kpa) / INITIAL_STEP_KPA) + 1
        initial = np.linspace(low_kpa, high_kpa, count)
        solved = estimate(initial[:, None], initial[:, None] + np.array(RISES_KPA), balloon, circuit, law)
        self.low_kpa, self.step_kpa = low_kpa, float(initial[1] - initial[0])
        self.forces_n = [_solved(row) for row in solved.force_n]
        self.indentations_mm = solved.indentation_mm.tolist()

    def press(self, initial_kpa: float, force_n: float) -> tuple[float, float, float]:
        """Rise [kPa], indentation [mm], and the force [N] as far as the table goes."""
        row, w = self._place(initial_kpa)
        low, high = self.forces_n[row], self.forces_n[row + 1]

        def force(column: int) -> float:
            return low[column] + w * (high[column] - low[column])

        right = _column(low, high, force_n, force)
        left = right - 1
        f0, f1 = force(left), force(right)
        share = (force_n - f0) / (f1 - f0) if force_n < f1 else 1.0
        d_low, d_high = self.indentations_mm[row], self.indentations_mm[row + 1]
        d0 = d_low[left] + w * (d_high[left] - d_low[left])
        d1 = d_low[right] + w * (d_high[right] - d_low[right])
        rise = RISES_KPA[left] + share * (RISES_KPA[right] - RISES_KPA[left])
        return rise, d0 + share * (d1 - d0), f0 + share * (f1 - f0)

    def _place(self, initial_kpa: float) -> tuple[int, float]:
        """The row below ΔP_i, and how far ΔP_i is on the way to the next one."""
        place = (initial_kpa - self.low_kpa) / self.step_kpa
        if place <= 0:
            return 0, 0.0
        row = int(place)
        last = len(self.forces_n) - 2
        return (row, place - row) if row <= last else (last, 1.0)


def _column(low: list[float], high: list[float], force_n: float, force: Callable[[int], float]) -> int:
    """The column at or after which the force between two rows reaches `force_n`, not the first one.

    It lies between the columns in which the two rows do: that leaves two or three to look at.
    """
    last = min(len(low), len(high)) - 1
    in_low, in_high = bisect_left(low, force_n, 0, last), bisect_left(high, force_n, 0, last)
    first, end = (in_low, in_high) if in_low < in_high else (in_high, in_low)
    return bisect_left(range(last), force_n, first, end, key=force) or 1


def _solved(forces_n: np.ndarray) -> list[float]:
    """A row as far as the law has a root; it must rise throughout."""
    row: list[float] = forces_n[np.isfinite(forces_n)].tolist()
    assert all(b > a for a, b in pairwise(row))
    return row


@cache
def _sheets(balloon: Balloon, circuit: Circuit, law: Law) -> tuple[_Sheet, _Sheet]:
    """Up to the switch, and above it. Nothing changes them: balloons that are alike share them."""
    switch_kpa = balloon.switch_kpa
    above_kpa = math.nextafter(switch_kpa, math.inf)
    return (
        _Sheet(LOWEST_INITIAL_KPA, switch_kpa, balloon, circuit, law),
        _Sheet(above_kpa, HIGHEST_INITIAL_KPA, balloon, circuit, law),
    )


class PublishedPlant:
    """The paper's balloon. The first construction takes about 0.1 s, a step some microseconds.

    The law is tabulated for the circuit's own volume and ambient pressure; other gas moves along it by the
    pressure that it would have without contact.
    """

    def __init__(
        self, balloon: Balloon | None = None, circuit: Circuit | None = None, low: Low = "line"
    ) -> None:
        """`low`: how force and rise go to zero together below a rise of 0.5 kPa."""
        law = Law(low=low)
        self.balloon = balloon or Balloon()
        self.circuit = circuit or Circuit()
        self._radius = (
            self.balloon.rest_radius_mm,
            self.balloon.radius_linear_mm_per_kpa,
            self.balloon.radius_quadratic_mm_per_kpa2,
        )
        self._caps, self._sphere = _sheets(self.balloon, self.circuit, law)

    def radius_mm(self, pressure_kpa: float) -> float:
        """Radius R_i [mm] of the free balloon, by the quadratic of Fig. 4."""
        radius: float = self.balloon.radius_mm(pressure_kpa)
        return radius

    def settle(self, gas: Gas, force_n: float) -> BalloonState:
        """The balloon that holds this gas under this force [N]."""
        initial_kpa = self._initial_kpa(gas)
        rise_kpa, indentation_mm, contact_radius_mm = 0.0, 0.0, 0.0
        if force_n > 0:
            rise_kpa, indentation_mm, carried_n = self._press(initial_kpa, force_n)
            radius_mm = self.radius_mm(initial_kpa)
            contact_radius_mm = _contact_radius(carried_n, initial_kpa + rise_kpa, radius_mm)
        final_kpa = initial_kpa + rise_kpa
        volume = gas.amount_kpa_mm3 / (gas.outside_kpa + final_kpa) - gas.tubes_mm3
        return BalloonState(final_kpa, indentation_mm, contact_radius_mm, volume)

    def _initial_kpa(self, gas: Gas) -> float:
        """Pressure [kPa] of this gas without contact, by Newton.

        p·V rises with p ever more steeply, so that from the second on all steps come from above. Beyond the
        quadratic the balloon keeps its volume.
        """
        amount, tubes, outside = gas
        rest, linear, quadratic = self._radius
        pressure = MIDDLE_KPA
        for _ in range(MOST_STEPS):
            bend = quadratic * pressure
            radius = rest + (bend + linear) * pressure
            area = FOUR_PI * radius * radius
            volume = tubes + area * radius / 3
            absolute = outside + pressure
            step = (absolute * volume - amount) / (volume + absolute * area * (bend + bend + linear))
            pressure -= step
            if pressure < LOWEST_FREE_KPA:
                return self._rigid_kpa(gas, LOWEST_FREE_KPA)
            if -CLOSE_KPA < step < CLOSE_KPA:
                break
        return pressure if pressure <= HIGHEST_FREE_KPA else self._rigid_kpa(gas, HIGHEST_FREE_KPA)

    def _rigid_kpa(self, gas: Gas, free_kpa: float) -> float:
        """Pressure [kPa] of this gas in a balloon that keeps the volume it has at `free_kpa`."""
        volume_mm3: float = sphere_volume(self.radius_mm(free_kpa))
        return gas.amount_kpa_mm3 / (gas.tubes_mm3 + volume_mm3) - gas.outside_kpa

    def _press(self, initial_kpa: float, force_n: float) -> tuple[float, float, float]:
        """Below the table's ΔP_i the rise fades out with the pressure: an empty balloon carries nothing."""
        sheet = self._sphere if initial_kpa > self.balloon.switch_kpa else self._caps
        rise_kpa, indentation_mm, carried_n = sheet.press(initial_kpa, force_n)
        if initial_kpa < LOWEST_INITIAL_KPA:
            rise_kpa *= max(initial_kpa, 0.0) / LOWEST_INITIAL_KPA
        return rise_kpa, indentation_mm, carried_n


def _contact_radius(force_n: float, pressure_kpa: float, radius_mm: float) -> float:
    """Contact radius a [mm] from F = ΔP_f π a², eq. (1); an empty balloon lies flat at most."""
    flat = math.pi / 2 * radius_mm
    if not pressure_kpa > 0:
        return flat
    return min(math.sqrt(force_n * 1e3 / (math.pi * pressure_kpa)), flat)
