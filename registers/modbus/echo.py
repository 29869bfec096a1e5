"""Our own answer, heard again on a two-wire line whose adapter listens while it sends."""

from __future__ import annotations

import math

from registers.modbus.rtu import Timing

_ADAPTER_S = 0.025  #: between the last byte on the line and our hearing it: a USB adapter's timer is 16 ms
_TRUST_S = 60.0  #: for so long a line that gave no echo is believed to give none


class Echo:
    """Tells our own answer from a request.

    Most answers cannot be requests, and what follows them shows whether the line echoes. An answer to
    function 6, 8 or 22 equals its request: taken for one, its echo would be answered for ever. It is an
    echo where it comes as soon as one would, unless the line gave none within the last minute; and even then
    where it comes that soon twice in a row. A master that says the same that often, and nothing else, has to
    say it once more.
    """

    def __init__(self, timing: Timing) -> None:
        self._timing = timing
        self._sent = b""
        self._like_its_request = False
        self._due_s = -math.inf  #: when an echo must have come
        self._trusted_s = -math.inf
        self._came_back = False  #: the frame before, as soon as an echo would

    def sent(self, answer: bytes, request: bytes, now_s: float) -> None:
        """`answer` is being sent."""
        self._sent, self._like_its_request = answer, answer == request
        self._due_s = now_s + len(answer) * self._timing.character_s + _ADAPTER_S

    def is_echo(self, frame: bytes, now_s: float, first: bool) -> bool:
        """Whether `frame` is our answer come back; `first`: not a byte was lost since we sent it."""
        sent, self._sent = self._sent, b""
        before, self._came_back = self._came_back, frame == sent and now_s <= self._due_s
        if frame != sent:
            if sent and first:
                self._trusted_s = now_s + _TRUST_S
            return False
        if not self._like_its_request or (before and self._came_back):
            self._trusted_s = -math.inf
            return True
        return self._came_back and self._trusted_s < now_s
