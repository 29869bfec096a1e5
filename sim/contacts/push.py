"""Pushes: the action of a contact on the balloon at one instant, given as a force or as a travel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from pneuforce.sim.contacts.tissue import Tissue, force_at_travel


class Push(Protocol):
    """Action of a contact on the balloon at one instant."""

    @property
    def cosine(self) -> float:
        """Return the fraction of the applied force that presses along the axis of the balloon."""
        ...

    @property
    def last_n(self) -> float:
        """Return the last known force along the axis [N], without a new computation of the balloon."""
        ...

    def force_n(self, indentation_of: Callable[[float], float]) -> float:
        """Return the force along the axis [N].

        `indentation_of` returns the indentation of the balloon [mm] under a force [N].
        """
        ...


class ForcePush(NamedTuple):
    """Given force, independent of the balloon. Without friction, only the axial part F·cos θ presses."""

    applied_n: float
    cosine: float = 1.0

    @property
    def last_n(self) -> float:
        """Return the force along the axis [N]."""
        return self.applied_n * self.cosine

    def force_n(self, indentation_of: Callable[[float], float]) -> float:  # noqa: ARG002
        """Return the force along the axis [N]."""
        return self.applied_n * self.cosine


@dataclass(slots=True)
class TravelPush:
    """Given travel along the axis, shared by the balloon and the tissue behind the balloon.

    The computed force is the start value of the next computation.
    """

    tissue: Tissue
    travel_mm: float = 0.0
    cosine: float = 1.0
    last_n: float = 0.0

    def force_n(self, indentation_of: Callable[[float], float]) -> float:
        """Return the force along the axis [N]."""
        self.last_n = force_at_travel(self.travel_mm, self.tissue, indentation_of, self.last_n)
        return self.last_n
