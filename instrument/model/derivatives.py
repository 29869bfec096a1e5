"""Exact derivatives of a solved contact by whatever it was solved from.

The root d of a balance g(d; x) = 0 moves with an input x by −(∂g/∂x)/(∂g/∂d). The partial derivatives come
from one evaluation at x + ih, h tiny (the complex step): exact to rounding, no difference quotient.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

from instrument.model.balloon import Balloon, Circuit, Number
from instrument.model.law import Law
from instrument.model.methods import METHODS
from instrument.model.pressed import Pressed

_STEP = 1e-30


class Inputs(NamedTuple):
    """All that a force is computed from. Any number in it may be moved."""

    initial_kpa: Number
    final_kpa: Number
    balloon: Balloon
    circuit: Circuit
    radius_error_mm: Number = 0.0


class Slope(NamedTuple):
    """How fast a solved contact moves with one input."""

    force_n: Number  #: dF/dx [N per unit of x]
    indentation_mm: Number  #: dd/dx [mm per unit of x]


class Derivatives:
    """Derivatives at one solved contact, or at an array of them."""

    def __init__(self, indentation_mm: Number, inputs: Inputs, law: Law) -> None:
        self._d, self._inputs, self._law = indentation_mm, inputs, law
        self._balance_by_d, self._force_by_d = self._partial(indentation_mm + 1j * _STEP, inputs)

    def by(self, **steps: float) -> Slope:
        """Total derivatives along a direction: the fields of `Inputs` and how far each goes per unit."""
        moved = {name: getattr(self._inputs, name) + 1j * _STEP * length for name, length in steps.items()}
        return self._along(self._inputs._replace(**moved))

    def by_balloon(self, name: str) -> Slope:
        """Total derivatives by one field of the balloon."""
        return self._along(self._inputs._replace(balloon=_moved(self._inputs.balloon, name)))

    def by_circuit(self, name: str) -> Slope:
        """Total derivatives by one field of the circuit."""
        return self._along(self._inputs._replace(circuit=_moved(self._inputs.circuit, name)))

    def _along(self, moved: Inputs) -> Slope:
        balance, force = self._partial(self._d, moved)
        d = -balance / self._balance_by_d
        return Slope(force + self._force_by_d * d, d)

    def _partial(self, d: Number, inputs: Inputs) -> tuple[Number, Number]:
        """Imaginary parts of the balance and of the force, per step."""
        initial, final, balloon, circuit, radius_error = inputs
        weight = self._law.small_strain(initial, balloon)
        pressed = Pressed.between(initial, final, weight, balloon, circuit, radius_error)
        method = METHODS[self._law.method]
        rf, gap = method.final_radius_mm(d, pressed), pressed.radius_mm - d
        force = 1e-3 * math.pi * pressed.final_kpa * (rf * rf - gap * gap)
        return method.balance(d, pressed)[0].imag / _STEP, force.imag / _STEP


def _moved(part: Any, name: str) -> Any:
    return replace(part, **{name: getattr(part, name) + 1j * _STEP})
