"""All that a bus may ask of the instrument: one snapshot to render from, and one way to write."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol


class Peer(NamedTuple):
    """Who is asking: the channel, and within it the address that a lease is tied to."""

    channel: str  #: one of the names of the lease-holder register: modbus_tcp, modbus_rtu, can, page
    address: str = ""


class Source(Protocol):
    """The instrument as a bus sees it. Every quantity of the register map is an attribute of a snapshot."""

    def snapshot(self, peer: Peer, now_s: float) -> Any:
        """One instant, as `peer` sees it: immutable, its attributes named by the map's `quantity`."""
        ...

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> str:
        """Carry out one request that names quantities and their new values, all or nothing.

        Returns the name of a refusal, "none" where it was accepted. The values have passed the map's spans.
        A request for mode "vent" is always carried out, whatever else is refused.
        """
        ...

    def master_lost(self, now_s: float) -> None:
        """Hear that the CAN master, whose heartbeat the bus watches, is silent: nobody commands any more."""
        ...

    def master_back(self, now_s: float) -> None:
        """Hear that a lost CAN master is heard again, or that nobody watches it any more."""
        ...

    def refused(self, peer: Peer, request: bytes, why: str, now_s: float) -> None:
        """Hear of a request to write that its bus refused and never brought here, for whoever keeps a log."""
        ...
