"""Interface between the instrument and the bus servers: read a snapshot, write quantities."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Protocol

from pneuforce.support.rejected_write import RejectedWrite


class Peer(NamedTuple):
    """Sender of a request: the channel, and the address on that channel. A lease belongs to a peer."""

    channel: str  #: a name as in the register lease_holder; rdt only reads, and mqtt only vents
    address: str = ""


class Source(Protocol):
    """Interface of the instrument for the bus servers."""

    def snapshot(self, peer: Peer, now_s: float) -> Any:
        """Return all values at one instant. Some values depend on the peer, for example its reject reason.

        The snapshot is immutable. It has one attribute for each quantity of the register map and of the
        CANopen objects.
        """
        ...

    @property
    def discrete_state(self) -> Hashable:
        """Return a value that changes if a sample changes the state, the status or the faults.

        A server can skip the snapshot of a sample while this value does not change. This value need not show
        changes that depend on the time alone. The server finds them with a snapshot at each tick.
        """
        ...

    @property
    def force_limit_exceeded(self) -> bool:
        """Return True if the latest sample raises the force alarm."""
        ...

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> str:
        """Carry out one write request, either completely or not at all. Return the reject reason.

        `values` maps quantities to their new values, already checked against the ranges of the register map.
        The reject reason is "none" if the request was accepted. A request for mode "vent" is always carried
        out, even if the rest of the request is rejected.
        """
        ...

    def master_lost(self, now_s: float) -> None:
        """Report that the heartbeat of the monitored CANopen master is missing."""
        ...

    def master_recovered(self, now_s: float) -> None:
        """Report that the heartbeat of a lost master is back, or that monitoring was switched off."""
        ...

    def log_rejected_write(self, peer: Peer, rejected: RejectedWrite, now_s: float) -> None:
        """Log a write request that the bus server rejected and did not pass to `write`."""
        ...
