"""The `membrane` plant: states of the rubber balloon, interpolated in its table."""

from __future__ import annotations

import math

from pneuforce.sim.plants.membrane.cache import cached_table
from pneuforce.sim.plants.membrane.material import MOONEY_RIVLIN, Rubber
from pneuforce.sim.plants.membrane.paths import Contact, Sides
from pneuforce.sim.plants.membrane.table import COLUMNS, ROWS, MembraneTable, ProgressCallback, blend
from pneuforce.sim.plants.plant import AMBIENT_KPA, TUBES_MM3, BalloonState, Gas

START_KPA = 8.0
MAX_ITERATIONS = 50
#: Amount of gas within which the table is nearly linear [kPa·mm³]; it changes the pressure by 0.035 kPa. A
#: Newton step that is smaller is accurate, and is the last step.
LINEAR_GAS = 1000.0
#: Volume of a completely flat balloon [mm³]. In a circuit without tubes, the gas law divides by this volume.
MIN_VOLUME_MM3 = 1.0
#: Last row that has a next row, and last column that has a next column, for the interpolation.
LAST_ROW, LAST_COLUMN = ROWS - 2, COLUMNS - 2


class MembranePlant:
    """Rubber balloon, pressed by one plate (the other half is in a holder) or between two plates.

    The first construction takes some seconds. Later constructions read the table from the cache. The plant
    has no state, so several rigs can use it. Outside the table, the balloon is treated as a rigid vessel.
    """

    def __init__(
        self,
        material: Rubber = MOONEY_RIVLIN,
        sides: Sides = 1,
        progress: ProgressCallback = lambda _done, _total: None,
        contact: Contact | float = "slide",
    ) -> None:
        """Load or compute the table. `progress(done, total)` is called during the computation.

        A number as `contact` selects a table between "slide" (0) and "stick" (1). Raises ValueError if
        `sides` is neither 1 nor 2, or if the number is not in the range 0 to 1.
        """
        if sides not in (1, 2):
            raise ValueError(f"a balloon is pressed on 1 or 2 sides, not {sides}")
        self.material, self.sides, self.contact = material, sides, contact
        table = _table(material, sides, contact, progress)
        self._min_gas: float = table.gas_kpa_mm3[0].item()
        self._max_gas: float = table.gas_kpa_mm3[-1].item()
        self._rows_per_gas: float = (ROWS - 1) / (self._max_gas - self._min_gas)
        self._highest_n: list[float] = table.highest_n.tolist()
        self._pressures_kpa: list[list[float]] = table.pressure_kpa.tolist()
        self._heights_mm: list[list[float]] = table.half_height_mm.tolist()
        self._free_kpa: list[float] = [row[0] for row in self._pressures_kpa]
        self._free_mm: list[float] = [row[0] for row in self._heights_mm]

    def radius_mm(self, pressure_kpa: float) -> float:
        """Return the radius [mm] of the free balloon, limited to the radius at its limit point."""
        return float(self.material.radius_mm * self.material.free_stretch(pressure_kpa))

    def settle(self, gas: Gas, force_n: float) -> BalloonState:
        """Return the equilibrium with this gas under this force [N]."""
        amount, tubes, outside = gas
        low, high = self._min_gas, self._max_gas
        if tubes == TUBES_MM3 and outside == AMBIENT_KPA:
            reference_gas = free = min(max(amount, low), high)
        else:
            reference_gas = free = self._free_reference_gas(amount, tubes, outside)
            if force_n > 0:
                reference_gas = self._pressed_reference_gas(amount, tubes, outside, force_n, free)
        row, row_weight, column, column_weight, carried, _ = self._position(reference_gas, force_n)
        reference_kpa = _interpolate(self._pressures_kpa, row, row_weight, column, column_weight)
        volume = max(reference_gas / (reference_kpa + AMBIENT_KPA) - TUBES_MM3, MIN_VOLUME_MM3)
        pressure = amount / (tubes + volume) - outside
        if not carried > 0:
            return BalloonState(pressure, 0.0, 0.0, volume)
        radius = self._free_radius(free)
        indentation = max(
            radius - _interpolate(self._heights_mm, row, row_weight, column, column_weight), 0.0
        )
        return BalloonState(
            pressure, indentation, math.sqrt(carried * 1e3 / (math.pi * reference_kpa)), volume
        )

    def _free_radius(self, reference_gas: float) -> float:
        at = (reference_gas - self._min_gas) * self._rows_per_gas
        row = int(min(at, LAST_ROW))
        below = self._free_mm[row]
        return below + (at - row) * (self._free_mm[row + 1] - below)

    def _free_reference_gas(self, amount: float, tubes_mm3: float, outside_kpa: float) -> float:
        """Return the amount of gas that gives a free balloon the same size in the reference circuit."""
        min_gas, max_gas, per_gas, pressures = (
            self._min_gas,
            self._max_gas,
            self._rows_per_gas,
            self._free_kpa,
        )
        start_kpa, more = START_KPA + AMBIENT_KPA, tubes_mm3 - TUBES_MM3
        low, high = min_gas - 1.0, max_gas + 1.0
        gas = amount * start_kpa / (START_KPA + outside_kpa) - start_kpa * more
        for _ in range(MAX_ITERATIONS):
            gas = min_gas if gas < min_gas else max_gas if gas > max_gas else gas
            at = (gas - min_gas) * per_gas
            row = int(at) if at < LAST_ROW else LAST_ROW
            rise = pressures[row + 1] - pressures[row]
            pressure, slope = pressures[row] + (at - row) * rise, rise * per_gas
            gas, low, high = _newton_step(gas, low, high, pressure, slope, amount, more, outside_kpa)
            if low == high or low >= max_gas or high <= min_gas:
                break
        return min(max(gas, min_gas), max_gas)

    def _pressed_reference_gas(
        self, amount: float, tubes_mm3: float, outside_kpa: float, force_n: float, start: float
    ) -> float:
        """Return the amount of gas that gives a pressed balloon the same shape in the reference circuit."""
        min_gas, max_gas, more = self._min_gas, self._max_gas, tubes_mm3 - TUBES_MM3
        low, high, gas = min_gas - 1.0, max_gas + 1.0, start
        for _ in range(MAX_ITERATIONS):
            gas = min_gas if gas < min_gas else max_gas if gas > max_gas else gas
            row, row_weight, column, column_weight, _, shift = self._position(gas, force_n)
            lower, upper = self._pressures_kpa[row], self._pressures_kpa[row + 1]
            p00, p10 = lower[column], upper[column]
            p01, p11 = lower[column + 1] - p00, upper[column + 1] - p10
            rise = p10 - p00 + column_weight * (p11 - p01)
            pressure = p00 + column_weight * p01 + row_weight * rise
            slope = (rise + shift * (p01 + row_weight * (p11 - p01))) * self._rows_per_gas
            gas, low, high = _newton_step(gas, low, high, pressure, slope, amount, more, outside_kpa)
            if low == high or low >= max_gas or high <= min_gas:
                break
        return min(max(gas, min_gas), max_gas)

    def _position(self, gas: float, force_n: float) -> tuple[int, float, int, float, float, float]:
        """Return row, weight of the next row, column, weight of the next column, force [N] and shift.

        The force is limited to the highest force of the row. The shift is the change of the column from row
        to row at a constant force: the column depends on the highest force of the row.
        """
        at = (gas - self._min_gas) * self._rows_per_gas
        row = int(at) if at < LAST_ROW else LAST_ROW
        row_weight = at - row
        if not force_n > 0:
            return row, row_weight, 0, 0.0, 0.0, 0.0
        widening = self._highest_n[row + 1] - self._highest_n[row]
        highest = self._highest_n[row] + row_weight * widening
        if force_n >= highest:
            return row, row_weight, LAST_COLUMN, 1.0, highest, 0.0
        across = math.sqrt(force_n / highest) * (COLUMNS - 1)
        column = int(across)
        return row, row_weight, column, across - column, force_n, -0.5 * across * widening / highest


def _table(
    material: Rubber, sides: Sides, contact: Contact | float, progress: ProgressCallback
) -> MembraneTable:
    if isinstance(contact, str):
        return cached_table(material, sides, contact, progress)
    if not 0 <= contact <= 1:
        raise ValueError(f"the contact is slide, stick or a number from 0 to 1, not {contact}")
    slide = cached_table(material, sides, "slide", lambda done, total: progress(done, 2 * total))
    stick = cached_table(material, sides, "stick", lambda done, total: progress(total + done, 2 * total))
    return blend(slide, stick, contact)


def _interpolate(
    table: list[list[float]], row: int, row_weight: float, column: int, column_weight: float
) -> float:
    """Return a value between four cells of a table. The weights are those of the next row and column."""
    lower, upper = table[row], table[row + 1]
    below = lower[column] + column_weight * (lower[column + 1] - lower[column])
    return below + row_weight * (upper[column] + column_weight * (upper[column + 1] - upper[column]) - below)


def _newton_step(
    gas: float,
    low: float,
    high: float,
    pressure_kpa: float,
    slope: float,
    amount: float,
    more_tubes_mm3: float,
    outside_kpa: float,
) -> tuple[float, float, float]:
    """Return the next iterate of a bracketed Newton method, and both ends of the bracket.

    After the last step, both ends are equal.
    """
    reference, actual = pressure_kpa + AMBIENT_KPA, pressure_kpa + outside_kpa
    volume = more_tubes_mm3 + gas / reference
    excess = actual * volume - amount
    steepness = slope * volume + actual * (1 - gas * slope / reference) / reference
    step = excess / steepness if steepness > 0 else math.inf
    if -LINEAR_GAS < step < LINEAR_GAS:
        return gas - step, gas, gas
    low, high = (low, gas) if excess > 0 else (gas, high)
    following = gas - step
    return (following if low < following < high else (low + high) / 2), low, high
