"""Contacts, and the phases in which contacts are played."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from pneuforce.sim.contacts.push import ForcePush, Push, TravelPush
from pneuforce.sim.contacts.tissue import Tissue
from pneuforce.sim.contacts.trajectory import Trajectory


class Contact(NamedTuple):
    """One contact of the simulated hand with the balloon."""

    trajectory: Trajectory  #: travel [mm] if there is `tissue`, otherwise force [N]
    angle_deg: float = 0.0  #: angle between the force and the axis of the balloon
    tissue: Tissue | None = None
    pause_s: float = 0.0  #: time without contact after the trajectory

    @property
    def duration_s(self) -> float:
        """Return the duration [s], including the pause after the contact."""
        return self.trajectory.duration_s + self.pause_s

    def pusher(self) -> Callable[[float], Push]:
        """Return a function that converts a value of the trajectory to a push.

        The value is a force [N], or a travel [mm] if there is `tissue`.
        """
        if self.tissue is None:
            cosine = math.cos(math.radians(self.angle_deg))
            return lambda applied_n: ForcePush(applied_n, cosine)
        push = TravelPush(self.tissue)

        def moved(travel_mm: float) -> Push:
            push.travel_mm = travel_mm
            return push

        return moved


class Phase(NamedTuple):
    """Contacts at one setpoint."""

    setpoint_kpa: float
    contacts: tuple[Contact, ...]
