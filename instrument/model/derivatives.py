"""Exact derivatives of a solved contact with respect to each input of the force law.

The indentation d is the root of a balance g(d; x) = 0. Its derivative with respect to an input x is
−(∂g/∂x)/(∂g/∂d). Each partial derivative comes from one evaluation of g with an imaginary step: x + ih or
d + ih with a tiny h (complex-step method). Unlike difference quotients, these derivatives are exact except
for rounding.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

from pneuforce.instrument.model.balloon import Balloon, Circuit, Number
from pneuforce.instrument.model.contact_geometry import ContactGeometry
from pneuforce.instrument.model.law import ForceLaw
from pneuforce.instrument.model.methods import METHODS

_STEP = 1e-30


class ModelInputs(NamedTuple):
    """All inputs of the force law, including the fields of the balloon and of the circuit."""

    baseline_kpa: Number
    final_kpa: Number
    balloon: Balloon
    circuit: Circuit
    radius_error_mm: Number = 0.0


class ContactDerivative(NamedTuple):
    """Derivative of a solved contact with respect to one input x."""

    force_n: Number  #: dF/dx [N per unit of x]
    indentation_mm: Number  #: dd/dx [mm per unit of x]


class ContactDifferentiator:
    """Derivatives at one solved contact, or at an array of solved contacts."""

    def __init__(self, indentation_mm: Number, inputs: ModelInputs, law: ForceLaw) -> None:
        self._d, self._inputs, self._law = indentation_mm, inputs, law
        self._balance_by_d, self._force_by_d = self._partial(indentation_mm + 1j * _STEP, inputs)

    def by(self, **steps: float) -> ContactDerivative:
        """Return the total derivative with respect to a variable x that changes one or more inputs.

        Each keyword is a field of `ModelInputs`. Its value is the change of this field per unit of x.
        """
        moved = {name: getattr(self._inputs, name) + 1j * _STEP * length for name, length in steps.items()}
        return self._total(self._inputs._replace(**moved))

    def by_balloon(self, name: str) -> ContactDerivative:
        """Return the total derivative with respect to the field `name` of the balloon."""
        return self._total(self._inputs._replace(balloon=_moved(self._inputs.balloon, name)))

    def by_circuit(self, name: str) -> ContactDerivative:
        """Return the total derivative with respect to the field `name` of the circuit."""
        return self._total(self._inputs._replace(circuit=_moved(self._inputs.circuit, name)))

    def _total(self, moved: ModelInputs) -> ContactDerivative:
        balance, force = self._partial(self._d, moved)
        d = -balance / self._balance_by_d
        return ContactDerivative(force + self._force_by_d * d, d)

    def _partial(self, d: Number, inputs: ModelInputs) -> tuple[Number, Number]:
        """Return the partial derivatives of the balance and of the force.

        The derivatives are with respect to the argument that has the imaginary step.
        """
        baseline, final, balloon, circuit, radius_error = inputs
        weight = self._law.small_strain_weight(baseline, balloon)
        geometry = ContactGeometry.between(baseline, final, weight, balloon, circuit, radius_error)
        method = METHODS[self._law.method]
        rf, gap = method.final_radius_mm(d, geometry), geometry.radius_mm - d
        force = 1e-3 * math.pi * geometry.final_kpa * (rf * rf - gap * gap)
        return method.balance(d, geometry)[0].imag / _STEP, force.imag / _STEP


def _moved(part: Any, name: str) -> Any:
    return replace(part, **{name: getattr(part, name) + 1j * _STEP})
