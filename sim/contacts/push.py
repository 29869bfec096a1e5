"""Pushes: what a contact does to the balloon at one instant, whether it drives the force or the travel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from sim.contacts.tissue import Tissue, force_at_travel


class Push(Protocol):
    """At one instant."""

    @property
    def cosine(self) -> float:
        """Share of the applied force that presses along the balloon's axis."""
        ...

    @property
    def last_n(self) -> float:
        """Force [N] along the axis, as far as it is known without the balloon."""
        ...

    def force_n(self, indentation_of: Callable[[float], float]) -> float:
        """Force [N] along the axis, where the balloon gives way by `indentation_of(force)` [mm]."""
        ...


class ForcePush(NamedTuple):
    """A force, whatever the balloon does. Without friction only its part along the axis presses: F·cos θ."""

    applied_n: float
    cosine: float = 1.0

    @property
    def last_n(self) -> float:
        """Force [N] along the axis."""
        return self.applied_n * self.cosine

    def force_n(self, indentation_of: Callable[[float], float]) -> float:  # noqa: ARG002
        """Force [N] along the axis."""
        return self.applied_n * self.cosine


@dataclass(slots=True)
class TravelPush:
    """A travel along the axis, shared by the balloon and the tissue behind it. Remembers its force."""

    tissue: Tissue
    travel_mm: float = 0.0
    cosine: float = 1.0
    last_n: float = 0.0

    def force_n(self, indentation_of: Callable[[float], float]) -> float:
        """Force [N] along the axis."""
        self.last_n = force_at_travel(self.travel_mm, self.tissue, indentation_of, self.last_n)
        return self.last_n
