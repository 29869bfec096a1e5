"""Presses of a balloon at a constant amount of gas, from the free balloon to the flat balloon.

On each path, the angle φ_c of the edge of the contact increases in small steps. Each step has two unknowns:
one stretch of the skin, and the pressure. The two conditions are a vertical skin at the equator, and the gas
law.

Without friction (`slide`), the unknown stretch is that at the pole, because the skin on the plate is in
equilibrium. With `stick`, each point of the skin keeps the stretches that it had when it touched the plate.
The unknown stretch is then λ1 at the edge, and each step adds the ring dr = R₀ λ1 dφ_c to the skin on the
plate. When the force decreases, a sticking skin takes the same path in the opposite direction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from pneuforce.sim.plants.membrane.free_half import FreeHalf, free_half
from pneuforce.sim.plants.membrane.material import Skin
from pneuforce.sim.plants.membrane.shooting import (
    EQUATOR,
    Array,
    Point,
    edge_tension,
    free_part,
    frictionless_edge,
    slack_limit,
)
from pneuforce.sim.plants.plant import AMBIENT_KPA, TUBES_MM3

Contact = Literal["slide", "stick"]
Sides = Literal[1, 2]

#: Slope of the pressure over the unknown of the pressure where the free half does not change [kPa].
SLOPE_KPA = 30.0
#: Change of both unknowns for the numerical derivatives, and largest change in one Newton step.
DIFFERENCE, MAX_CHANGE = 1e-6, 0.1
#: Weight of the residual of the gas law, relative to the slope [rad], and tolerance of both.
GAS_WEIGHT, TOLERANCE, MAX_NEWTON_STEPS = 1e3, 1e-5, 15
EXTRAPOLATED_NODES = 4
#: First contact fractions: the part of the half meridian that lies on the plate. The steps are small, because
#: the shape of a skin that is hardly stretched changes only near the edge of a small contact.
SMALL_CONTACTS = (0.005, 0.01, 0.02, 0.03, 0.04, 0.055, 0.075)
MAX_FLAT_KPA, BISECTIONS = 400.0, 60


class SealedCircuit(NamedTuple):
    """Circuit of a sealed balloon. During a contact, (ΔP + P₀)·Vⁿ of all gas is constant."""

    tubes_mm3: float = TUBES_MM3
    ambient_kpa: float = AMBIENT_KPA
    gas_exponent: float | Array = 1.0  #: one value, or one for each path


class PressedBalloon(NamedTuple):
    """Balloon that is pressed by one plate, or between two plates.

    With one side, the other half is free, and has the same pressure.
    """

    skin: Skin
    sides: Sides = 1
    contact: Contact = "slide"
    circuit: SealedCircuit = SealedCircuit()


class Node(NamedTuple):
    """Shapes of all paths at one angle of the edge of the contact."""

    angle: float
    stretch: Array  #: stretch λ1 at the pole (slide) or at the edge of the contact (stick)
    pressure_unknown: Array  #: unknown of the pressure, see `_FreeVolume`
    pressure_kpa: Array
    contact_radius_mm: Array
    half_height_mm: Array  #: distance from the plate to the equator


@dataclass(frozen=True, slots=True)
class _FreeVolume:
    """Pressure, and volume of the free half, as functions of one unknown.

    Up to the limit point, the unknown is the pole stretch of the free half. The volume is then a smooth
    function of the unknown, but not of the pressure. Beyond the limit point, the pressure does not determine
    the volume of the free half: the free half keeps its volume.
    """

    free: FreeHalf
    start: Array  #: pole stretches before the contact
    fixed: npt.NDArray[np.bool_]  #: True if the free half never changes

    @classmethod
    def of(cls, balloon: PressedBalloon, start: Array) -> _FreeVolume:
        free = free_half(balloon.skin)
        return cls(free, start, (start > free.limit_stretch) | (balloon.sides == 2))

    def pressure_kpa(self, unknown: Array) -> Array:
        knee = np.where(self.fixed, self.start, np.minimum(unknown, self.free.limit_stretch))
        pressure: Array = self.free.pressure_at(knee) + SLOPE_KPA * (unknown - knee)
        return pressure

    def volume_mm3(self, unknown: Array) -> Array:
        knee = np.where(self.fixed, self.start, np.minimum(unknown, self.free.limit_stretch))
        volume: Array = self.free.volume_at(knee)
        return volume


@dataclass(frozen=True, slots=True)
class _Step:
    """Equations of one step. All arrays have the paths along their last axis."""

    balloon: PressedBalloon
    free_volume: _FreeVolume
    log_gas: Array  #: ln((ΔP + P₀)·Vⁿ) before the contact
    before: Node
    angle: float

    def edge(self, stretch: Array) -> Point:
        """Return the edge of the contact. The radius of a sticking edge is found by the trapezoidal rule."""
        skin = self.balloon.skin
        if self.balloon.contact == "slide":
            return frictionless_edge(skin, stretch, np.asarray(self.angle))
        ring = (
            skin.material.radius_mm * (self.angle - self.before.angle) * (self.before.stretch + stretch) / 2
        )
        return Point(self.before.contact_radius_mm + ring, stretch, 0.0 * stretch)

    def node(self, stretch: Array, unknown: Array) -> tuple[Node, Array]:
        """Return the node with these unknowns, and the residuals of both conditions along the first axis."""
        edge, pressure = self.edge(stretch), self.free_volume.pressure_kpa(unknown)
        part = free_part(self.balloon.skin, edge, self.angle, pressure)
        other = part.volume_mm3 if self.balloon.sides == 2 else self.free_volume.volume_mm3(unknown)
        gas = log_gas(self.balloon.circuit, pressure, part.volume_mm3 + other)
        node = Node(self.angle, stretch, unknown, pressure, edge.r_mm, part.height_mm)
        return node, np.stack([part.equator.slope - EQUATOR, gas - self.log_gas])

    def solve(self, stretch: Array, unknown: Array) -> Node:
        """Return the node, found by Newton's method from these first estimates. Shapes not found are NaN."""
        unknowns = np.stack([stretch, unknown])
        found = np.full((len(Node._fields) - 1, stretch.size), np.nan)
        unsolved = np.flatnonzero(np.isfinite(unknowns).all(axis=0))
        for _ in range(MAX_NEWTON_STEPS):
            if not unsolved.size:
                break
            step = self._of(unsolved)
            node, residuals = step.node(*(unknowns[:, None, unsolved] + _SHIFTS))
            size = np.hypot(residuals[0, 0], GAS_WEIGHT * residuals[1, 0])
            change = np.clip(_newton_change(residuals), -MAX_CHANGE, MAX_CHANGE)
            unknowns[:, unsolved] += change
            # The last change is so small that the values at the new unknowns follow from the derivatives.
            values = np.stack(node[1:])
            by_unknowns = (values[:, 1:] - values[:, :1]) / DIFFERENCE
            values = values[:, 0] + (by_unknowns * change).sum(axis=1)
            solved = (size <= TOLERANCE) & (step.tension(values[0]) > 0)
            found[:, unsolved[solved]] = values[:, solved]
            unsolved = unsolved[size > TOLERANCE]
        return Node(self.angle, *found)

    def tension(self, stretch: Array) -> Array:
        """Return the tension at the edge [kPa·mm]. If the tension is not above zero, the shape is invalid."""
        return edge_tension(self.balloon.skin, self.edge(stretch), self.angle)

    def _of(self, index: npt.NDArray[np.intp]) -> _Step:
        """Return the same step for the paths with these indices only."""
        free_volume = replace(
            self.free_volume, start=self.free_volume.start[index], fixed=self.free_volume.fixed[index]
        )
        before = Node(self.before.angle, *(value[index] for value in self.before[1:]))
        circuit = self.balloon.circuit
        exponents = np.broadcast_to(circuit.gas_exponent, self.log_gas.shape)[index]
        balloon = self.balloon._replace(circuit=circuit._replace(gas_exponent=exponents))
        gas = self.log_gas[index]
        return replace(self, balloon=balloon, free_volume=free_volume, log_gas=gas, before=before)


#: Shifts of the unknowns in the three evaluations of a Newton step: none, the stretch, the other unknown.
_SHIFTS = DIFFERENCE * np.array([[[0.0], [1.0], [0.0]], [[0.0], [0.0], [1.0]]])


def _newton_change(residuals: Array) -> Array:
    """Return the changes of both unknowns that make the residuals zero, by their numerical derivatives."""
    slope, gas = residuals[:, 0]
    (slope_1, slope_2), (gas_1, gas_2) = (residuals[:, 1:] - residuals[:, :1]) / DIFFERENCE
    determinant = slope_1 * gas_2 - slope_2 * gas_1
    change: Array = np.stack([slope_2 * gas - gas_2 * slope, gas_1 * slope - slope_1 * gas]) / determinant
    return change


def log_gas(circuit: SealedCircuit, pressure_kpa: Array, balloon_mm3: Any) -> Array:
    """Return ln((ΔP + P₀)·Vⁿ), with the volume V of the gas in the balloon and in the tubes."""
    volume = np.log(balloon_mm3 + circuit.tubes_mm3)
    amount: Array = np.log(pressure_kpa + circuit.ambient_kpa) + circuit.gas_exponent * volume
    return amount


def press_nodes(balloon: PressedBalloon, free_stretch: Array, fractions: Array) -> Iterator[Node]:
    """Yield the nodes of the paths. In the first node, the balloon is free, and in the last node flat.

    `free_stretch` contains the stretch at the pole before the contact, for each path. `fractions` are the
    increasing parts (0 to 1) of the half meridian that lie on the plate. After a shape that does not exist,
    all values of the path are NaN.
    """
    free, free_volume = free_half(balloon.skin), _FreeVolume.of(balloon, free_stretch)
    pressure = free.pressure_at(free_stretch)
    gas = log_gas(balloon.circuit, pressure, 2 * free.volume_at(free_stretch))
    zero = 0.0 * free_stretch
    node = Node(0.0, free_stretch, free_stretch, pressure, zero, free.height_at(free_stretch))
    yield node
    nodes = [node]
    for angle in fractions * EQUATOR:
        estimates = _extrapolated(nodes[-EXTRAPOLATED_NODES:], angle)
        with np.errstate(all="ignore"):
            node = _Step(balloon, free_volume, gas, nodes[-1], float(angle)).solve(*estimates)
        yield node
        nodes.append(node)
    yield _flat(balloon, free_volume, gas, node)


def _flat(balloon: PressedBalloon, free_volume: _FreeVolume, gas: Array, last: Node) -> Node:
    """Return the node at which the pressed half is completely flat and contains no gas.

    Without friction, the tension at the rim is then zero. Therefore, the radius does not depend on the
    pressure. With `stick`, the last ring has the stretch of the last node.
    """
    low, high = free_volume.start, free_volume.start + MAX_FLAT_KPA / SLOPE_KPA
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        volume = 0.0 if balloon.sides == 2 else free_volume.volume_mm3(middle)
        above = log_gas(balloon.circuit, free_volume.pressure_kpa(middle), volume) > gas
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    if balloon.contact == "slide":
        radius = slack_limit(balloon.skin, np.array([EQUATOR]))[1] + 0.0 * low
    else:
        ring = balloon.skin.material.radius_mm * last.stretch * (EQUATOR - last.angle)
        radius = last.contact_radius_mm + ring
    return Node(EQUATOR, last.stretch, low, free_volume.pressure_kpa(low), radius, 0.0 * low)


def _extrapolated(nodes: list[Node], angle: float) -> tuple[Array, Array]:
    """Return estimates of both unknowns at an angle, by Lagrange's polynomial through the last nodes."""
    weights = [
        np.prod([(angle - other.angle) / (node.angle - other.angle) for other in nodes if other is not node])
        for node in nodes
    ]
    weighted = list(zip(weights, nodes, strict=True))
    stretch = sum((weight * node.stretch for weight, node in weighted), start=np.zeros(1))
    return stretch, sum((weight * node.pressure_unknown for weight, node in weighted), start=np.zeros(1))
