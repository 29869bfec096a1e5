"""Interfaces of the loop in the instrument's process. The loop reads a rig or replays a recording."""

from __future__ import annotations

import asyncio
from typing import Protocol

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.event_counts import EventCounts
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.rig.link import Link
from pneuforce.instrument.service.host.command_gaps import CommandGaps
from pneuforce.registers.source import Peer, Source


class OutputChannel(Protocol):
    """Output channel that is called for each sample and each tick."""

    def on_sample(self, now_s: float) -> None:
        """Handle a new measurement."""
        ...

    def tick(self, now_s: float) -> None:
        """Do periodic work. The loop calls this method even if no samples arrive."""
        ...


class HostLoop(Protocol):
    """Loop that feeds a session and calls the output channels."""

    channels: list[OutputChannel]
    url: str  #: port of the rig, or file of the recording
    reconnects: int
    command_gaps: CommandGaps

    @property
    def session(self) -> Session:
        """Return the session that the loop feeds."""
        ...

    @property
    def instrument(self) -> Instrument:
        """Return the instrument of the session."""
        ...

    @property
    def link(self) -> Link:
        """Return the link of the session."""
        ...

    async def connect(self, stop: asyncio.Event) -> None:
        """Connect to the rig, or return when `stop` is set. Raises RigError."""
        ...

    async def run(self, stop: asyncio.Event) -> None:
        """Run until `stop` is set."""
        ...

    def end_at_once(self) -> None:
        """End without a wait for the verification of the vent."""
        ...


class ServedSource(Source, Protocol):
    """Source that is notified of logins, the state of the CAN bus and the end of the instrument."""

    can_down: bool
    counts: EventCounts

    def log_login(self, peer: Peer, kind: str, result: str, now_s: float) -> None:
        """Log a login or a logout of a user. The address of `peer` begins with the name of the user."""
        ...

    def log_failed_logins(self, peer: Peer, reason: str, times: int, now_s: float, user: str = "") -> None:
        """Log that `peer` has failed to log in. `times` is the number of failed logins.

        `user` is the name that was sent; empty if it is unknown or not a name.
        """
        ...

    def end(self, why: str, now_s: float) -> None:
        """Handle the end of the instrument. `why` is the reason."""
        ...
