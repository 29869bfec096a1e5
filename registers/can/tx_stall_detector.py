"""Detector for a CAN controller that accepts no frames.

Some failures, for example an unplugged cable, are not reported by the controller as errors. The only sign is
a transmit buffer that stays full.
"""

from __future__ import annotations

from dataclasses import dataclass

STALL_S = 1.0


@dataclass(slots=True)
class TxStallDetector:
    """Detector that reports a stall after one second in which every frame was rejected."""

    stalled: bool = False
    _since_s: float | None = None

    def frame_rejected(self, now_s: float) -> bool:
        """Record a frame that the controller rejected; return True if the stall begins with this frame."""
        if self._since_s is None:
            self._since_s = now_s
        begins = not self.stalled and now_s - self._since_s >= STALL_S
        self.stalled |= begins
        return begins

    def frame_sent(self) -> bool:
        """Record a frame that the controller accepted; return True if this frame ends a stall."""
        ends = self.stalled
        self.stalled, self._since_s = False, None
        return ends
