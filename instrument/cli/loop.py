"""What goes round in the instrument's process: a host that reads a rig, or a player in its place."""

from __future__ import annotations

import asyncio
from typing import Protocol

from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.host import Face
from instrument.rig.link import Link
from registers.source import Source


class Loop(Protocol):
    """Feeds a coupling, and tells the faces."""

    faces: list[Face]
    url: str  #: where what it is fed with comes from
    reconnects: int

    @property
    def coupling(self) -> Coupling:
        """What is fed."""
        ...

    @property
    def instrument(self) -> Instrument:
        """The coupling's."""
        ...

    @property
    def link(self) -> Link:
        """The coupling's."""
        ...

    async def connect(self, stop: asyncio.Event) -> None:
        """Get ready, or come back when `stop` is set. Raises RigError."""
        ...

    async def run(self, stop: asyncio.Event) -> None:
        """Go round until `stop` is set."""
        ...


class Shown(Source, Protocol):
    """A source that is told how its CAN bus is, and of its end."""

    can_down: bool

    def end(self, why: str, now_s: float) -> None:
        """Hear that nothing goes round any more, and why."""
        ...
