"""Detector for the echo of an answer on a two-wire line whose adapter receives while it sends."""

from __future__ import annotations

import math

from pneuforce.registers.modbus.rtu import RtuTiming

#: Longest time from the last byte on the line until this process reads the byte. A USB adapter can delay a
#: byte by 16 ms.
_ADAPTER_S = 0.025
#: After a missing echo, the line is assumed to have no echo for this time.
_NO_ECHO_VALID_S = 60.0


class EchoDetector:
    """Detector that distinguishes the echo of an answer from a request.

    Most answers differ from their request. A frame that equals such an answer is an echo. The next frame
    after such an answer shows whether the line has an echo.

    An answer to function 6, 8 or 22 equals its request. If its echo were treated as a request, the unit would
    answer its own answers for ever. A frame that equals such an answer and arrives within the echo delay is
    an echo, except if an echo was missing within the last minute. The second of two such frames in a row is
    always an echo. Disadvantage: a master that repeats a request within the echo delay, and sends nothing
    else, must send the request once more.
    """

    def __init__(self, timing: RtuTiming) -> None:
        self._timing = timing
        self._sent = b""
        self._answer_equals_request = False
        self._due_s = -math.inf  #: latest arrival time of an echo
        self._no_echo_until_s = -math.inf  #: end of the time in which the line is assumed to have no echo
        self._previous_was_prompt = False  #: the previous frame equalled the answer and arrived in time

    def sent(self, answer: bytes, request: bytes, now_s: float) -> None:
        """Record that `answer` is being sent in response to `request`."""
        self._sent, self._answer_equals_request = answer, answer == request
        self._due_s = now_s + len(answer) * self._timing.character_s + _ADAPTER_S

    def is_echo(self, frame: bytes, now_s: float, nothing_lost: bool) -> bool:
        """Return True if `frame` is the echo of the last answer.

        `nothing_lost` means that no byte was lost since the answer was sent.
        """
        sent, self._sent = self._sent, b""
        previous = self._previous_was_prompt
        self._previous_was_prompt = frame == sent and now_s <= self._due_s
        if frame != sent:
            if sent and nothing_lost:
                self._no_echo_until_s = now_s + _NO_ECHO_VALID_S
            return False
        if not self._answer_equals_request or (previous and self._previous_was_prompt):
            self._no_echo_until_s = -math.inf
            return True
        return self._previous_was_prompt and self._no_echo_until_s < now_s
