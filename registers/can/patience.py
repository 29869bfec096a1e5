"""When a controller that takes no frames is called down: an unplugged cable alone is no error."""

from __future__ import annotations

from dataclasses import dataclass

REFUSED_S = 1.0


@dataclass(slots=True)
class Patience:
    """Ends after a second of refused frames with none taken between them."""

    ended: bool = False
    _since_s: float | None = None

    def refused(self, now_s: float) -> bool:
        """Hear of a frame refused; True where patience ends with it."""
        if self._since_s is None:
            self._since_s = now_s
        ends = not self.ended and now_s - self._since_s >= REFUSED_S
        self.ended |= ends
        return ends

    def taken(self) -> bool:
        """Hear of a frame taken; True where patience had ended."""
        had_ended = self.ended
        self.ended, self._since_s = False, None
        return had_ended
