"""Lease: the peer that commands the rig must renew its lease, or the balloon is vented."""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Sender of a write: the channel, and the address on this channel. Peers are compared, never parsed.
Peer = tuple[str, str]


@dataclass(slots=True)
class Lease:
    """Exclusive right of one peer to write, until the peer ends the lease or does not renew it in time."""

    duration_s: float = 0.0  #: duration of the lease; 0 if there is no lease
    holder: Peer | None = None
    _until_s: float = 0.0

    def admits(self, peer: Peer) -> bool:
        """Return True if the lease allows a write by `peer`."""
        return self.holder is None or self.holder == peer

    def take(self, peer: Peer, duration_s: float, now_s: float) -> None:
        """Begin or change the lease of `peer`. A duration of 0 ends the lease."""
        self.duration_s = duration_s
        self.holder = peer if duration_s > 0 else None
        self._until_s = now_s + duration_s

    def renew(self, peer: Peer, now_s: float) -> None:
        """Restart the time of the lease if `peer` is its holder."""
        if self.holder == peer:
            self._until_s = now_s + self.duration_s

    def left_s(self, now_s: float) -> float:
        """Return the time until the lease ends [s], 0 without a lease."""
        return max(0.0, self._until_s - now_s) if self.holder else 0.0

    def overdue_s(self, now_s: float) -> float:
        """Return the time since the end of the lease [s]; negative before its end, and without a lease."""
        return now_s - self._until_s if self.holder else -math.inf

    def expire(self, now_s: float) -> bool:
        """End the lease if its time is over; return True if it ended now."""
        if self.holder is None or now_s <= self._until_s:
            return False
        self.take(self.holder, 0.0, now_s)
        return True
