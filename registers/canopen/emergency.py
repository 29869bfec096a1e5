"""Emergency objects (CiA 301, 7.2.7): the error register, the messages to send, and the error history."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from pneuforce.registers.can.frames import (
    COMMAND,
    EMERGENCY,
    GENERIC_ERROR,
    NO_ERROR,
    PDO_TOO_LONG,
    PDO_TOO_SHORT,
    RIG_ERROR,
    encode,
)
from pneuforce.registers.canopen.communication import ERROR_HISTORY_LENGTH

#: Bits of the error register, and the error codes that belong to the bit "communication error".
_GENERIC_BIT, _COMMUNICATION_BIT = 0x01, 0x10
_COMMUNICATION_ERRORS = range(0x8100, 0x8300)
#: Maximum number of messages that wait while the node is stopped or during an inhibit time. The oldest
#: message is dropped first.
_MAX_PENDING = 32


def length_errors(command: bytes) -> frozenset[int]:
    """Return the error code of a Command with a wrong length (CiA 301, 7.2.7.1); empty if it is right."""
    if len(command) == COMMAND.length:
        return frozenset()
    return frozenset((PDO_TOO_SHORT if len(command) < COMMAND.length else PDO_TOO_LONG,))


class EmergencyProducer:
    """Producer of the message "no error" when any error is gone, and of one message for each new error.

    A message contains the values at the time of its error, even if the message is sent later.
    """

    def __init__(self) -> None:
        self.history: deque[int] = deque(maxlen=ERROR_HISTORY_LENGTH)  #: error codes, the newest first
        self._pending: deque[bytes] = deque(maxlen=_MAX_PENDING)
        self._faults: tuple[int, ...] = ()
        self._errors: frozenset[int] = frozenset()
        self._sent_s = -math.inf

    @property
    def error_register(self) -> int:
        """Return the error register (1001h)."""
        register = GENERIC_ERROR if self._faults else 0
        register |= _GENERIC_BIT if self._errors else 0
        return register | (_COMMUNICATION_BIT if self._errors & set(_COMMUNICATION_ERRORS) else 0)

    @property
    def pending(self) -> bool:
        """Return True if a message waits, for example because of the inhibit time."""
        return bool(self._pending)

    def update(self, snapshot: Any, errors: frozenset[int]) -> None:
        """Queue messages if the faults or the errors of the node have changed since the last call.

        `errors` are the error codes of the present errors of the node.
        """
        faults = snapshot.faults
        if (faults, errors) == (self._faults, self._errors):
            return
        old_faults, old_errors = self._faults, self._errors
        self._faults, self._errors = faults, errors
        if not (set(old_faults) <= set(faults) and old_errors <= errors):
            self._queue(NO_ERROR, snapshot)
        new_codes = sorted(errors - old_errors)
        for code in new_codes + [RIG_ERROR + fault for fault in faults if fault not in old_faults]:
            self.history.appendleft(code)
            self._queue(code, snapshot)

    def _queue(self, code: int, snapshot: Any) -> None:
        data = encode(EMERGENCY, snapshot, error_code=code, error_register=self.error_register)
        self._pending.append(data)

    def due(self, now_s: float, inhibit_s: float) -> list[bytes]:
        """Return the data of the messages to send now: all messages, or one message per inhibit time."""
        if not self._pending or now_s < self._sent_s + inhibit_s:
            return []
        self._sent_s = now_s
        if inhibit_s:
            return [self._pending.popleft()]
        due = list(self._pending)
        self._pending.clear()
        return due
