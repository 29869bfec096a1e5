"""Counts of events since the start of the host process, for monitoring. A replay does not need them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from pneuforce.instrument.core.lease import Peer

MAX_REASONS = 64  #: different reasons that are counted; further reasons are counted as `OTHERS`
OTHERS = "others"
_INFLATED = frozenset(("inflating", "settling", "holding"))
_VENTED = frozenset(("venting", "vented"))


@dataclass(slots=True)
class EventCounts:
    """Numbers of trips, vents, faults, rejected writes and failed logins."""

    trips: int = 0
    vents: int = 0
    faults: Counter[int] = field(default_factory=Counter)  #: by code
    rejected_writes: Counter[str] = field(default_factory=Counter)  #: by reason
    failed_logins: Counter[str] = field(default_factory=Counter)  #: by reason

    def count_state(self, before: str, now: str) -> None:
        """Count a change of the state: a trip, or a vent of an inflated balloon without a trip."""
        self.trips += now == "tripped" != before
        self.vents += before in _INFLATED and now in _VENTED

    def count_faults(self, before: Iterable[int], now: Iterable[int]) -> None:
        """Count each fault that was not latched before."""
        self.faults.update(set(now) - set(before))

    def count_rejected_write(self, reason: str) -> None:
        """Count a write that the instrument or the server of a bus has rejected."""
        _add(self.rejected_writes, reason, 1)

    def count_failed_logins(self, peer: Peer, reason: str, times: int) -> None:
        """Count failed logins on the web page.

        A failed handshake of Modbus/TCP Security is no login. Its server counts it.
        """
        if peer[0] == "web":
            _add(self.failed_logins, reason, times)

    def values(self) -> dict[str, Any]:
        """Return the counts as JSON values. The keys of JSON objects are texts."""
        return {
            "trips": self.trips,
            "vents": self.vents,
            "faults": {str(code): count for code, count in self.faults.items()},
            "rejected_writes": dict(self.rejected_writes),
            "failed_logins": dict(self.failed_logins),
        }


def _add(counts: Counter[str], reason: str, times: int) -> None:
    known = reason in counts or len(counts) < MAX_REASONS
    counts[reason if known else OTHERS] += times
