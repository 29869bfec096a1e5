"""The `membrane` plant: the rubber balloon as the rig sees it, read from its table."""

from __future__ import annotations

import math

from sim.membrane.cache import kept_table
from sim.membrane.family import Progress
from sim.membrane.material import MOONEY_RIVLIN, Rubber
from sim.membrane.table import COLUMNS, ROWS
from sim.plant import AMBIENT_KPA, TUBES_MM3, BalloonState, Gas

LIKELY_KPA = 8.0
MOST_STEPS = 50
#: Gas [kPa·mm³] (0.035 kPa) over which the table is straight enough for the last step to need no look.
STRAIGHT_GAS = 1000.0
#: What two skins that touch leave between them; with no tubes either, the gas law needs some place.
LEAST_MM3 = 1.0
LAST_ROW, LAST_COLUMN = ROWS - 2, COLUMNS - 2  # that have a next one


class MembranePlant:
    """A rubber balloon, pressed by a plate from one side while a house holds the other, or by two plates.

    The first construction takes some seconds, later ones read the table that it left on disk. It keeps no
    state: rigs may share it. Beyond the table the balloon keeps its shape, as a rigid vessel would.
    """

    def __init__(
        self,
        material: Rubber = MOONEY_RIVLIN,
        sides: int = 1,
        progress: Progress = lambda _done, _total: None,
    ) -> None:
        """`progress(done, total)` hears how the table grows. Raises ValueError unless `sides` is 1 or 2."""
        if sides not in (1, 2):
            raise ValueError(f"a balloon is pressed on 1 or 2 sides, not {sides}")
        self.material, self.sides = material, sides
        table = kept_table(material, sides, progress)
        self._least: float = table.gas_kpa_mm3[0].item()
        self._most: float = table.gas_kpa_mm3[-1].item()
        self._rows_per_gas: float = (ROWS - 1) / (self._most - self._least)
        self._highest_n: list[float] = table.highest_n.tolist()
        self._pressures_kpa: list[list[float]] = table.pressure_kpa.tolist()
        self._heights_mm: list[list[float]] = table.half_height_mm.tolist()
        self._free_kpa: list[float] = [row[0] for row in self._pressures_kpa]
        self._free_mm: list[float] = [row[0] for row in self._heights_mm]

    def radius_mm(self, pressure_kpa: float) -> float:
        """Radius [mm] of the free balloon up to its limit point; no pressure tells a larger one."""
        return float(self.material.radius_mm * self.material.free_stretch(pressure_kpa))

    def settle(self, gas: Gas, force_n: float) -> BalloonState:
        """The balloon that holds this gas under this force [N]."""
        amount, tubes, outside = gas
        least, most = self._least, self._most
        if tubes == TUBES_MM3 and outside == AMBIENT_KPA:
            alike = free = min(max(amount, least), most)
        else:
            alike = free = self._free_alike(amount, tubes, outside)
            if force_n > 0:
                alike = self._pressed_alike(amount, tubes, outside, force_n, free)
        row, share, column, part, carried, _ = self._place(alike, force_n)
        reference = _between(self._pressures_kpa, row, share, column, part)
        volume = max(alike / (reference + AMBIENT_KPA) - TUBES_MM3, LEAST_MM3)
        pressure = amount / (tubes + volume) - outside
        if not carried > 0:
            return BalloonState(pressure, 0.0, 0.0, volume)
        radius = self._free_radius(free)
        indentation = max(radius - _between(self._heights_mm, row, share, column, part), 0.0)
        return BalloonState(pressure, indentation, math.sqrt(carried * 1e3 / (math.pi * reference)), volume)

    def _free_radius(self, alike: float) -> float:
        at = (alike - self._least) * self._rows_per_gas
        row = int(min(at, LAST_ROW))
        below = self._free_mm[row]
        return below + (at - row) * (self._free_mm[row + 1] - below)

    def _free_alike(self, amount: float, tubes_mm3: float, outside_kpa: float) -> float:
        """Gas that the free balloon, with its size and pressure, would have in the reference circuit."""
        least, most, per_gas, pressures = self._least, self._most, self._rows_per_gas, self._free_kpa
        likely, more = LIKELY_KPA + AMBIENT_KPA, tubes_mm3 - TUBES_MM3
        low, high = least - 1.0, most + 1.0
        alike = amount * likely / (LIKELY_KPA + outside_kpa) - likely * more
        for _ in range(MOST_STEPS):
            alike = least if alike < least else most if alike > most else alike
            at = (alike - least) * per_gas
            row = int(at) if at < LAST_ROW else LAST_ROW
            rise = pressures[row + 1] - pressures[row]
            pressure, slope = pressures[row] + (at - row) * rise, rise * per_gas
            alike, low, high = _nearer(alike, low, high, pressure, slope, amount, more, outside_kpa)
            if low == high or low >= most or high <= least:
                break
        return min(max(alike, least), most)

    def _pressed_alike(
        self, amount: float, tubes_mm3: float, outside_kpa: float, force_n: float, start: float
    ) -> float:
        """The same of the pressed balloon."""
        least, most, more = self._least, self._most, tubes_mm3 - TUBES_MM3
        low, high, alike = least - 1.0, most + 1.0, start
        for _ in range(MOST_STEPS):
            alike = least if alike < least else most if alike > most else alike
            row, share, column, part, _, shift = self._place(alike, force_n)
            lower, upper = self._pressures_kpa[row], self._pressures_kpa[row + 1]
            p00, p10 = lower[column], upper[column]
            p01, p11 = lower[column + 1] - p00, upper[column + 1] - p10
            rise = p10 - p00 + part * (p11 - p01)
            pressure = p00 + part * p01 + share * rise
            slope = (rise + shift * (p01 + share * (p11 - p01))) * self._rows_per_gas
            alike, low, high = _nearer(alike, low, high, pressure, slope, amount, more, outside_kpa)
            if low == high or low >= most or high <= least:
                break
        return min(max(alike, least), most)

    def _place(self, gas: float, force_n: float) -> tuple[int, float, int, float, float, float]:
        """Row, share of the way to the next, column, part of the way to the next, force carried [N].

        Last, how many columns a force moves per row: the columns are wider where more is carried.
        """
        at = (gas - self._least) * self._rows_per_gas
        row = int(at) if at < LAST_ROW else LAST_ROW
        share = at - row
        if not force_n > 0:
            return row, share, 0, 0.0, 0.0, 0.0
        widening = self._highest_n[row + 1] - self._highest_n[row]
        highest = self._highest_n[row] + share * widening
        if force_n >= highest:
            return row, share, LAST_COLUMN, 1.0, highest, 0.0
        across = math.sqrt(force_n / highest) * (COLUMNS - 1)
        column = int(across)
        return row, share, column, across - column, force_n, -0.5 * across * widening / highest


def _between(table: list[list[float]], row: int, share: float, column: int, part: float) -> float:
    lower, upper = table[row], table[row + 1]
    below = lower[column] + part * (lower[column + 1] - lower[column])
    return below + share * (upper[column] + part * (upper[column + 1] - upper[column]) - below)


def _nearer(
    alike: float,
    low: float,
    high: float,
    pressure_kpa: float,
    slope: float,
    amount: float,
    more_tubes_mm3: float,
    outside_kpa: float,
) -> tuple[float, float, float]:
    """A Newton step kept inside the bracket, and the bracket, which closes with the last step."""
    reference, actual = pressure_kpa + AMBIENT_KPA, pressure_kpa + outside_kpa
    volume = more_tubes_mm3 + alike / reference
    excess = actual * volume - amount
    steepness = slope * volume + actual * (1 - alike * slope / reference) / reference
    step = excess / steepness if steepness > 0 else math.inf
    if -STRAIGHT_GAS < step < STRAIGHT_GAS:
        return alike - step, alike, alike
    low, high = (low, alike) if excess > 0 else (alike, high)
    nearer = alike - step
    return (nearer if low < nearer < high else (low + high) / 2), low, high
