"""The `published` plant: a balloon that obeys the energetic law of Gaudeni & Prattichizzo to the letter.

Free, it has the radius of their Fig. 4. Pressed, its pressure rises until the energetic law gives the force;
below a rise of 0.5 kPa force and rise are proportional. The law is tabulated once over (ΔP_i, rise).
"""

from __future__ import annotations

import math
from bisect import bisect_left
from itertools import pairwise

import numpy as np

from instrument.model import Balloon, Circuit, estimate
from instrument.model.balloon import LOWEST_RISE_KPA, sphere_volume
from sim.plant import BalloonState, Gas

LOWEST_FREE_KPA, HIGHEST_FREE_KPA = -3.7, 40.0  # where the quadratic of Fig. 4 rises
MIDDLE_KPA = 6.0
FINEST_STEP_KPA, MOST_STEPS = 1e-9, 50
INITIAL_STEP_KPA = 0.1
LOWEST_INITIAL_KPA = 0.5
HIGHEST_INITIAL_KPA = 18.0
#: A harder push than this rise does not raise the pressure further.
HIGHEST_RISE_KPA = 16.0
RISES_KPA = [0.0, *np.linspace(LOWEST_RISE_KPA, HIGHEST_RISE_KPA, 156).tolist()]


class _Sheet:
    """The law on one side of the switch of stretching energies: force and indentation by ΔP_i and rise."""

    def __init__(self, low_kpa: float, high_kpa: float, balloon: Balloon, circuit: Circuit) -> None:
        count = math.ceil((high_kpa - low_kpa) / INITIAL_STEP_KPA) + 1
        initial = np.linspace(low_kpa, high_kpa, count)
        law = estimate(initial[:, None], initial[:, None] + np.array(RISES_KPA), balloon, circuit)
        self.low_kpa, self.step_kpa = low_kpa, float(initial[1] - initial[0])
        self.forces_n = [_solved(row) for row in law.force_n]
        self.indentations_mm = law.indentation_mm.tolist()

    def press(self, initial_kpa: float, force_n: float) -> tuple[float, float, float]:
        """Rise [kPa], indentation [mm], and the force [N] as far as the table goes."""
        place = (initial_kpa - self.low_kpa) / self.step_kpa
        row = min(max(int(place), 0), len(self.forces_n) - 2)
        w = min(max(place - row, 0.0), 1.0)
        low, high = self.forces_n[row], self.forces_n[row + 1]

        def force(column: int) -> float:
            return low[column] + w * (high[column] - low[column])

        last = min(len(low), len(high)) - 1
        right = max(1, bisect_left(range(last), force_n, key=force))
        f0, f1 = force(right - 1), force(right)
        share = min((force_n - f0) / (f1 - f0), 1.0)
        d_low, d_high = self.indentations_mm[row], self.indentations_mm[row + 1]
        d0, d1 = (d_low[c] + w * (d_high[c] - d_low[c]) for c in (right - 1, right))
        rise = RISES_KPA[right - 1] + share * (RISES_KPA[right] - RISES_KPA[right - 1])
        return rise, d0 + share * (d1 - d0), f0 + share * (f1 - f0)


def _solved(forces_n: np.ndarray) -> list[float]:
    """A row as far as the law has a root; it must rise throughout."""
    row: list[float] = forces_n[np.isfinite(forces_n)].tolist()
    assert all(b > a for a, b in pairwise(row))
    return row


class PublishedPlant:
    """The paper's balloon. Construction takes about 0.1 s, a step some microseconds.

    The law is tabulated for the circuit's own volume and ambient pressure; other gas moves along it by the
    pressure that it would have without contact.
    """

    def __init__(self, balloon: Balloon | None = None, circuit: Circuit | None = None) -> None:
        self.balloon = balloon or Balloon()
        self.circuit = circuit or Circuit()
        switch_kpa = self.balloon.switch_kpa
        above_kpa = math.nextafter(switch_kpa, math.inf)
        self._caps = _Sheet(LOWEST_INITIAL_KPA, switch_kpa, self.balloon, self.circuit)
        self._sphere = _Sheet(above_kpa, HIGHEST_INITIAL_KPA, self.balloon, self.circuit)

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
        """Pressure [kPa] of this gas without contact, by Newton; p·V rises with p throughout."""
        pressure = MIDDLE_KPA
        for _ in range(MOST_STEPS):
            radius, slope = self.radius_mm(pressure), self.balloon.radius_slope_mm_per_kpa(pressure)
            volume = gas.tubes_mm3 + sphere_volume(radius)
            absolute = gas.outside_kpa + pressure
            step = (absolute * volume - gas.amount_kpa_mm3) / (
                volume + absolute * 4 * math.pi * radius**2 * slope
            )
            pressure = min(max(pressure - step, LOWEST_FREE_KPA), HIGHEST_FREE_KPA)
            if abs(step) < FINEST_STEP_KPA:
                break
        return pressure

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
