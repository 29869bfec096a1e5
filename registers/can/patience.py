"""When a controller that takes no frames is called down: an unplugged cable alone is no error."""

from __future__ import annotations

from dataclasses import dataclass

REFUSED_S = 1.0


@dataclass(slots=True)
class Patience:
    """Ends after a second of refused frames with none taken between them."""

    _since_s: float | None = None
    _told: bool = False

    def refused(self, now_s: float) -> bool:
        """Hear of a frame refused; True once, where patience has ended."""
        if self._since_s is None:
            self._since_s = now_s
        tell = self.has_ended(now_s) and not self._told
        self._told |= tell
        return tell

    def taken(self) -> bool:
        """Hear of a frame taken; True where that ends what `refused` told."""
        told = self._told
        self._since_s, self._told = None, False
        return told

    def has_ended(self, now_s: float) -> bool:
        """Whether nothing has been taken for too long."""
        since_s = self._since_s
        return since_s is not None and now_s - since_s >= REFUSED_S
