"""Table of the membrane estimator for one balloon and circuit: force by ΔP_i and rise, sliding and sticking.

The rows are equidistant in ΔP_i and the columns in √rise, because the force is nearly proportional to √rise.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA, Balloon, Circuit
from pneuforce.instrument.model.membrane.press import ContactPath, PressConditions, ProgressCallback, press
from pneuforce.instrument.model.rubber import Floats, RubberSkin, skin_of

#: Values of ΔP_i [kPa]. All setpoints of the board lie between them.
BASELINES_KPA = np.arange(1.5, 13.01, 0.5)
#: Values of √rise [√kPa], up to a rise of 16 kPa.
ROOT_STEP = 0.05
ROOTS = np.arange(0, 81) * ROOT_STEP
#: Every how many rows the derivatives with respect to radius and volume are computed.
DERIVATIVE_ROWS = 4
#: Changes of radius and volume by which the derivatives are computed.
RADIUS_CHANGE_MM, VOLUME_CHANGE = 0.05, 0.03
#: Decimal digits of the values. The error of the computation is larger than the last digit.
TABLE_DIGITS = 8
#: Order of the contacts in the first dimension of the table.
CONTACTS = ("slide", "stick")
#: Quantities of the table in the order of its first dimension: force [N], indentation d [mm], and derivatives
#: of the force with respect to the inflated radius [N/mm] and to the volume of the tubes [N/mm³].
QUANTITIES = ("force", "indentation", "force_by_radius", "force_by_volume")
SHAPE = (len(QUANTITIES), len(CONTACTS), len(BASELINES_KPA), len(ROOTS))


class TableValues(NamedTuple):
    """Interpolated quantities and their derivatives: arrays (quantities, contacts, …)."""

    value: Any
    by_baseline: Any  #: derivative with respect to ΔP_i at a constant rise
    by_rise: Any  #: derivative with respect to the rise at a constant ΔP_i


@dataclass(frozen=True, slots=True, eq=False)
class ForceTable:
    """Table of one balloon."""

    values: Floats  #: array of the shape `SHAPE`; NaN where there is no solution
    ambient_kpa: float  #: ambient pressure P_0 for which the table was computed
    _counts: NDArray[np.int64] = field(init=False)  # number of solutions of each row

    def __post_init__(self) -> None:
        object.__setattr__(self, "_counts", np.isfinite(self.values[0]).all(axis=0).sum(axis=1))

    @property
    def is_consistent(self) -> bool:
        """Return True if the forces grow with the rise and with the grip.

        The part of the table in the measuring range of ΔP_i and up to a rise of 2 kPa is checked.
        """
        rows = (BASELINES_KPA >= VALID_LOW_KPA) & (BASELINES_KPA <= VALID_HIGH_KPA)
        force_n = self.values[0][:, rows][:, :, ROOTS <= 2**0.5]
        slides, sticks = force_n
        return bool((np.diff(force_n, axis=2) > 0).all() and (sticks[:, 2:] > slides[:, 2:]).all())

    def at(self, baseline_kpa: Any, rise_kpa: Any) -> TableValues:
        """Return all quantities at one ΔP_i and rise, or at arrays of equal shape; NaN outside the table.

        The interpolation is cubic in both directions, through the 4 × 4 nearest values. It ends where the
        first of the 4 rows ends.
        """
        root = np.sqrt(np.maximum(rise_kpa, 1e-12))
        step_kpa = BASELINES_KPA[1] - BASELINES_KPA[0]
        row = (np.asarray(baseline_kpa) - BASELINES_KPA[0]) / step_kpa
        column = np.asarray(root) / ROOT_STEP
        rows, row_weights, row_slopes = _cubic(row, len(BASELINES_KPA))
        columns, column_weights, column_slopes = _cubic(column, self._counts[rows].min(axis=-1))
        near = self.values[:, :, rows[..., :, None], columns[..., None, :]]
        value = np.einsum("qc...ij,...i,...j->qc...", near, row_weights, column_weights)
        by_row = np.einsum("qc...ij,...i,...j->qc...", near, row_slopes, column_weights)
        by_column = np.einsum("qc...ij,...i,...j->qc...", near, row_weights, column_slopes)
        return TableValues(value, by_row / step_kpa, by_column / (2 * root * ROOT_STEP))


def _cubic(position: Any, count: Any) -> tuple[Any, Floats, Floats]:
    """Return indices, weights and slopes of the cubic through the 4 nearest of `count` equidistant values.

    The last dimension of the results has 4 elements. Outside the values, the weights are NaN.
    """
    inside = (position >= 0) & (position <= count - 1)
    position = np.where(inside, position, 0.0)
    first = np.clip(position.astype(int) - 1, 0, np.maximum(count, 4) - 4)
    x = np.where(inside, position - first, np.nan)
    a, b, c, d = x, x - 1, x - 2, x - 3
    weights = np.stack([-b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6], axis=-1)
    slopes = np.stack(
        [
            -(b * c + b * d + c * d) / 6,
            (a * c + a * d + c * d) / 2,
            -(a * b + a * d + b * d) / 2,
            (a * b + a * c + b * c) / 6,
        ],
        axis=-1,
    )
    return first[..., None] + np.arange(4), weights, slopes


def compute_table(
    balloon: Balloon, circuit: Circuit, sides: int, progress: ProgressCallback = lambda _done, _all: None
) -> ForceTable:
    """Return the table of a balloon that is pressed on one or two sides.

    `progress(done, total)` is called during the computation, which takes about ten seconds.
    """
    rubber = skin_of(balloon)
    larger = skin_of(balloon, RADIUS_CHANGE_MM)
    volume = circuit.volume_mm3
    sparse = BASELINES_KPA[::DERIVATIVE_ROWS]
    variants = [
        (rubber, BASELINES_KPA, volume),
        (larger, sparse, volume),
        (rubber, sparse, volume * (1 + VOLUME_CHANGE)),
    ]
    path = press(_conditions(variants, circuit, sides), progress=progress)
    sampled = _sampled(path, np.concatenate([np.tile(kpa, 2) for _, kpa, _ in variants]))
    ends = np.cumsum([2 * len(kpa) for _, kpa, _ in variants])
    base, by_radius, by_volume = (
        part.reshape(2, len(CONTACTS), -1, len(ROOTS)) for part in np.split(sampled, ends[:-1], axis=1)
    )
    force_n, indentation_mm = base
    sparse_n = force_n[:, ::DERIVATIVE_ROWS]
    force_by_radius = _dense((by_radius[0] - sparse_n) / RADIUS_CHANGE_MM)
    force_by_volume = _dense((by_volume[0] - sparse_n) / (volume * VOLUME_CHANGE))
    values = np.stack([force_n, indentation_mm, force_by_radius, force_by_volume])
    # Rounding makes the tables of different computers equal.
    return ForceTable(values.round(TABLE_DIGITS), circuit.ambient_kpa)


def _conditions(
    variants: list[tuple[RubberSkin, Floats, float]], circuit: Circuit, sides: int
) -> PressConditions:
    """Return the conditions of all presses: for each variant, those that slide and then those that stick."""
    count = [2 * len(baselines) for _, baselines, _ in variants]
    skins = zip(*((s.rest_radius_mm, s.c1_kpa_mm, s.c2_kpa_mm) for s, _, _ in variants), strict=True)
    total = sum(count)
    return PressConditions(
        RubberSkin(*(np.repeat(values, count) for values in skins)),
        np.concatenate([np.tile(baselines, 2) for _, baselines, _ in variants]),
        np.concatenate([np.repeat([False, True], len(baselines)) for _, baselines, _ in variants]),
        np.full(total, sides),
        np.repeat([volume for _, _, volume in variants], count),
        np.full(total, circuit.ambient_kpa),
        np.full(total, circuit.polytropic),
    )


def _sampled(path: ContactPath, baselines_kpa: Floats) -> Floats:
    """Return force and indentation of each press at `ROOTS`: an array (2, presses, roots).

    A path ends where the rise or the force stops increasing, because a flat disc is smaller than a nearly
    flat balloon.
    """
    from scipy.interpolate import CubicSpline

    result = np.full((2, len(baselines_kpa), len(ROOTS)), np.nan)
    rises = path.final_kpa - baselines_kpa
    for index, rise in enumerate(rises.T):
        force = path.force_n[:, index]
        falls = ~((np.diff(rise) > 0) & (np.diff(force) > 0))
        count = int(np.argmax(falls)) + 1 if falls.any() else len(rise)
        if count < 4:
            continue
        values = np.stack([force, path.indentation_mm[:, index]])[:, :count]
        root = np.sqrt(np.maximum(rise[:count], 0.0))
        inside = root[-1] >= ROOTS
        result[:, index, inside] = CubicSpline(root, values, axis=1)(ROOTS[inside])
    result[:, :, 0] = np.where(np.isfinite(result[:, :, 1]), 0.0, np.nan)
    return result


def _dense(sparse: Floats) -> Floats:
    """Return derivatives for all rows, interpolated linearly between every `DERIVATIVE_ROWS` rows.

    After the end of a path, the last derivative is used.
    """
    filled = sparse.copy()
    for column in range(1, filled.shape[2]):
        lost = ~np.isfinite(filled[:, :, column])
        filled[:, :, column][lost] = filled[:, :, column - 1][lost]
    known = BASELINES_KPA[::DERIVATIVE_ROWS]
    rows = np.clip(np.searchsorted(known, BASELINES_KPA, side="right") - 1, 0, len(known) - 2)
    share = ((BASELINES_KPA - known[rows]) / (known[rows + 1] - known[rows]))[None, :, None]
    dense: Floats = (1 - share) * filled[:, rows] + share * filled[:, rows + 1]
    return dense
