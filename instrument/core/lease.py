"""The lease: whoever commands the rig must keep saying so, or the balloon is vented."""

from __future__ import annotations

from dataclasses import dataclass

#: A channel and an address within it; compared, never parsed.
Peer = tuple[str, str]


@dataclass(slots=True)
class Lease:
    """Held by one peer until it ends it, or lets it run out."""

    duration_s: float = 0.0  #: 0: no lease
    holder: Peer | None = None
    _until_s: float = 0.0

    def admits(self, peer: Peer) -> bool:
        """Whether a write by `peer` may pass."""
        return self.holder is None or self.holder == peer

    def take(self, peer: Peer, duration_s: float, now_s: float) -> None:
        """Begin, change or (with 0) end the lease."""
        self.duration_s = duration_s
        self.holder = peer if duration_s > 0 else None
        self._until_s = now_s + duration_s

    def renew(self, peer: Peer, now_s: float) -> None:
        """An accepted write by the holder starts its time anew."""
        if self.holder == peer:
            self._until_s = now_s + self.duration_s

    def left_s(self, now_s: float) -> float:
        """Time left [s], 0 without a lease."""
        return max(0.0, self._until_s - now_s) if self.holder else 0.0

    def ran_out(self, now_s: float) -> bool:
        """Whether it has just run out; it is ended by that, so this is true once."""
        if self.holder is None or now_s <= self._until_s:
            return False
        self.take(self.holder, 0.0, now_s)
        return True
