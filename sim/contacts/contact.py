"""Contacts, and the phases that they are played in."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from sim.contacts.course import Course
from sim.contacts.push import ForcePush, Push, TravelPush
from sim.contacts.tissue import Tissue


class Contact(NamedTuple):
    """One contact: its course, and what it drives."""

    course: Course  #: of the travel [mm] where there is `tissue`, else of the force [N]
    angle_deg: float = 0.0  #: between the force and the balloon's axis
    tissue: Tissue | None = None
    pause_s: float = 0.0  #: without contact, after it

    @property
    def lasts_s(self) -> float:
        """How long it lasts [s], the pause after it included."""
        return self.course.lasts_s + self.pause_s

    def pusher(self) -> Callable[[float], Push]:
        """What makes the push of a force [N] or a travel [mm]."""
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
