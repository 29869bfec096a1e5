"""Press of balloons on a flat plate: equilibria with a growing contact, with a closed gas volume.

The gas law is (P_0 + ΔP)(V_c + V)ⁿ = constant. The contact grows by one node of the mesh in each step. In
each step, Newton's method solves for the free nodes, the height of the plate and the pressure. The plate
carries no force at the last node that touches: this node has just touched.

A skin that slides can move on the plate. In a skin that sticks, each node keeps the radius at which it
touched.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.instrument.model.membrane.elements import BANDWIDTH, Assembled, HalfBalloon
from pneuforce.instrument.model.rubber import Floats, RubberSkin

ELEMENTS = 100
#: Share of the nodes of the half meridian that are pressed on the plate one after the other.
LAST_NODE = 0.96
MAX_ITERATIONS, TOLERANCE_MM = 30, 1e-7
#: Largest change of a node in one iteration, as a multiple of the length of an element at rest.
MAX_STEP_ELEMENTS = 4.0

ProgressCallback = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class PressConditions:
    """Conditions of several presses. Each field has the shape (presses,)."""

    skin: RubberSkin
    baseline_kpa: Floats  #: ΔP_i
    sticks: npt.NDArray[np.bool_]  #: True if the skin sticks to the plate, False if it slides
    sides: npt.NDArray[np.int64]  #: 1: the other half is free; 2: both halves are pressed alike
    tubes_mm3: Floats  #: V_c
    ambient_kpa: Floats  #: P_0
    polytropic: Floats  #: n


class ContactPath(NamedTuple):
    """States of each press, from free to the largest contact: arrays (states, presses).

    The values of a state that was not found are NaN.
    """

    final_kpa: Floats  #: ΔP_f
    force_n: Floats  #: force of the plate
    contact_radius_mm: Floats  #: radius a of the contact
    indentation_mm: Floats  #: R_i minus the distance from the plate to the equator


def press(
    conditions: PressConditions,
    elements: int = ELEMENTS,
    progress: ProgressCallback = lambda _done, _all: None,
) -> ContactPath:
    """Return the path of each press. `progress(done, total)` is called during the computation."""
    state = _Presses.free(conditions, elements)
    last = int(LAST_NODE * elements)
    states = [state.result(0)]
    for node in range(1, last + 1):
        state.touch(node)
        states.append(state.result(node))
        progress(node, last)
    return ContactPath(*(np.stack(values) for values in zip(*states, strict=True)))


@dataclass(slots=True)
class _Presses:
    """Shapes of all presses at one size of the contact. `found` is False after a step without a solution."""

    conditions: PressConditions
    mesh: HalfBalloon
    r: Floats
    z: Floats
    pressure_kpa: Floats
    gas: Floats  #: (P_0 + ΔP)^(1/n) (V_c + V), which is constant
    free_radius_mm: Floats
    found: npt.NDArray[np.bool_]
    assembled: Assembled = field(init=False)

    @classmethod
    def free(cls, conditions: PressConditions, elements: int) -> _Presses:
        """Return the free balloons."""
        mesh = HalfBalloon(conditions.skin, elements)
        pressure = conditions.baseline_kpa.copy()
        radius = conditions.skin.rest_radius_mm * conditions.skin.free_stretch(pressure)
        found = np.isfinite(radius)
        start_mm = np.where(found, radius, conditions.skin.rest_radius_mm)[:, None]
        angle = mesh.rest_angle
        r, z = start_mm * np.sin(angle), start_mm * np.cos(angle)
        r[:, 0] = z[:, -1] = 0.0
        state = cls(conditions, mesh, r, z, pressure, 0 * pressure, radius, found)
        state._solve(None)
        volume, _ = state._total_volume()
        state.gas = state._density() * volume
        state.free_radius_mm = np.where(state.found, (state.r[:, -1] + state.z[:, 0]) / 2, np.nan)
        return state

    def touch(self, node: int) -> None:
        """Let the nodes up to `node` touch the plate, and solve for the equilibrium."""
        self.z[:, : node + 1] = self.z[:, node : node + 1]
        self._solve(node)

    def result(self, node: int) -> tuple[Floats, Floats, Floats, Floats]:
        """Return ΔP_f, force, contact radius and indentation. They are NaN if there is no solution."""
        residual = self._residual()
        force_n = -1e-3 * residual[:, 1 : 2 * node + 2 : 2].sum(axis=1) if node else 0 * self.pressure_kpa
        values = (self.pressure_kpa, force_n, self.r[:, node], self.free_radius_mm - self.z[:, 0])
        pressure, force, radius, indentation = (np.where(self.found, v, np.nan) for v in values)
        return pressure, force, radius, indentation

    def _residual(self) -> Floats:
        """Return the force on each unknown that the plate and the symmetry planes must carry [mN]."""
        assembled = self.assembled
        return assembled.energy_gradient - self.pressure_kpa[:, None] * assembled.volume_gradient

    def _density(self) -> Floats:
        """Return (P_0 + ΔP)^(1/n), to which the density of the gas is proportional."""
        conditions = self.conditions
        density: Floats = (conditions.ambient_kpa + self.pressure_kpa) ** (1 / conditions.polytropic)
        return density

    def _total_volume(self) -> tuple[Floats, Floats]:
        """Return the volume of all gas [mm³], and its derivative with respect to the pressure.

        The derivative is that of the half that is not pressed.
        """
        conditions, pressed = self.conditions, self.assembled.volume_mm3
        one_side = conditions.sides == 1
        free, by_pressure = conditions.skin.free_volume_mm3(self.pressure_kpa)
        other = np.where(one_side, free / 2, pressed)
        return conditions.tubes_mm3 + pressed + other, np.where(one_side, by_pressure / 2, 0.0)

    def _solve(self, node: int | None) -> None:
        """Solve for the equilibrium by Newton's method. `node` is the last node that touches the plate."""
        converged = ~self.found
        element_mm = self.conditions.skin.rest_radius_mm * np.pi / 2 / self.mesh.elements
        with np.errstate(all="ignore"):
            for _ in range(MAX_ITERATIONS):
                self.assembled = self.mesh.assemble(self.r, self.z, self.pressure_kpa)
                change, pressure_change = self._newton_step(node, converged)
                largest = np.abs(change).max(axis=1)
                lost = ~np.isfinite(largest + pressure_change)
                self.found &= ~lost
                converged |= lost
                step = np.minimum(1.0, MAX_STEP_ELEMENTS * element_mm / np.maximum(largest, 1e-12))
                step = np.where(converged, 0.0, step)
                moved = np.where(converged[:, None], 0.0, step[:, None] * change)
                self.r, self.z = self.r + moved[:, 0::2], self.z + moved[:, 1::2]
                self.pressure_kpa = self.pressure_kpa + np.where(converged, 0.0, step * pressure_change)
                converged |= largest < TOLERANCE_MM
                if converged.all():
                    break
        self.found &= converged
        self.assembled = self.mesh.assemble(self.r, self.z, self.pressure_kpa)

    def _newton_step(self, node: int | None, idle: npt.NDArray[np.bool_]) -> tuple[Floats, Floats]:
        """Return the changes of all unknowns (presses, unknowns), and of the pressures (presses,)."""
        volume_gradient, residual = self.assembled.volume_gradient, self._residual()
        fixed = self._fixed(node) | idle[:, None]
        if node is None:
            (change,) = _solve_banded(self.assembled.stiffness, fixed, [-residual])
            return change, 0 * self.pressure_kpa
        lift = np.zeros_like(residual)
        lift[:, 1 : 2 * node + 2 : 2] = 1.0
        lift_force = _multiply(self.assembled.stiffness, lift)
        change, by_lift, by_pressure = _solve_banded(
            self.assembled.stiffness, fixed, [-residual, -lift_force, volume_gradient]
        )
        by_lift = by_lift + lift
        # Two conditions: no force at the last node that touches, and the gas law.
        row, edge = self._row(2 * node + 1), 2 * node + 1
        volume, by_pressure_volume = self._total_volume()
        share = np.where(self.conditions.sides == 2, 2.0, 1.0)
        density = self._density()
        absolute = self.conditions.ambient_kpa + self.pressure_kpa
        compress = density / (self.conditions.polytropic * absolute) * volume + density * by_pressure_volume
        grow = (density * share)[:, None] * volume_gradient
        matrix = np.empty((len(volume), 2, 2))
        matrix[:, 0, 0] = _dot(row, by_lift)
        matrix[:, 0, 1] = _dot(row, by_pressure) - volume_gradient[:, edge]
        matrix[:, 1, 0] = _dot(grow, by_lift)
        matrix[:, 1, 1] = _dot(grow, by_pressure) + compress
        wanted_edge = -(residual[:, edge] + _dot(row, change))
        wanted_gas = self.gas - density * volume - _dot(grow, change)
        lifted, pressure_change = _solve_2x2(matrix, wanted_edge, wanted_gas)
        return change + by_lift * lifted[:, None] + by_pressure * pressure_change[:, None], pressure_change

    def _fixed(self, node: int | None) -> npt.NDArray[np.bool_]:
        """Return a mask of the unknowns that do not change: symmetry planes, plate, and stuck nodes."""
        fixed = np.zeros((len(self.pressure_kpa), 2 * self.r.shape[1]), bool)
        fixed[:, 0] = fixed[:, -1] = True
        if node is not None:
            fixed[:, 1 : 2 * node + 2 : 2] = True
            fixed[:, 0 : 2 * node + 1 : 2] |= self.conditions.sticks[:, None]
        return fixed

    def _row(self, unknown: int) -> Floats:
        """Return one row of the stiffness matrix (presses, unknowns)."""
        bands = self.assembled.stiffness
        row: Floats = np.zeros_like(bands[0])
        for offset in range(-BANDWIDTH, BANDWIDTH + 1):
            if 0 <= unknown - offset < row.shape[1]:
                row[:, unknown - offset] = bands[BANDWIDTH + offset, :, unknown - offset]
        return row


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("ij,ij->i", a, b)
    return product


def _solve_2x2(matrix: Floats, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Return the solutions of several systems of two linear equations."""
    a, b, c, d = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 0], matrix[:, 1, 1]
    determinant = a * d - b * c
    return (first * d - second * b) / determinant, (a * second - c * first) / determinant


def _multiply(bands: Floats, vector: Floats) -> Floats:
    """Return the product of banded matrices (7, presses, unknowns) and vectors (presses, unknowns)."""
    result = np.zeros_like(vector)
    count = vector.shape[1]
    for offset in range(-BANDWIDTH, BANDWIDTH + 1):
        column = slice(max(0, -offset), min(count, count - offset))
        row = slice(max(0, offset), min(count, count + offset))
        result[:, row] += bands[BANDWIDTH + offset, :, column] * vector[:, column]
    return result


def _solve_banded(bands: Floats, fixed: npt.NDArray[np.bool_], rights: list[Floats]) -> list[Floats]:
    """Return the solutions for several right sides, each (presses, unknowns). Fixed unknowns are zero.

    The matrices of all presses are the blocks of one banded matrix, which LAPACK solves in one call.
    """
    from scipy.linalg import solve_banded

    count = fixed.shape[1]
    matrix = bands.copy()
    for offset in range(-BANDWIDTH, BANDWIDTH + 1):
        column = slice(max(0, -offset), min(count, count - offset))
        row = slice(max(0, offset), min(count, count + offset))
        matrix[BANDWIDTH + offset, :, column][fixed[:, row] | fixed[:, column]] = 0.0
    matrix[BANDWIDTH][fixed] = 1.0
    right = np.stack([np.where(fixed, 0.0, values).ravel() for values in rights], axis=1)
    solved = solve_banded(
        (BANDWIDTH, BANDWIDTH),
        matrix.reshape(2 * BANDWIDTH + 1, -1),
        right,
        overwrite_ab=True,
        check_finite=False,
    )
    return [solved[:, index].reshape(fixed.shape) for index in range(len(rights))]
