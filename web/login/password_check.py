"""Check of passwords in a thread, because a hash needs 80 ms and must not delay a vent.

Only one hash is computed at a time, so that logins need one core and 32 MB at most. The thread has the lowest
priority of the process. Few checks may wait.
"""

from __future__ import annotations

import asyncio
import threading
from functools import partial

from pneuforce.instrument.users.password import NO_PASSWORD, PasswordHash
from pneuforce.support.background import run_in_background
from pneuforce.support.priority import reduce_priority

MAX_WAITING = 16  #: the last of them waits for about 2 s
RESERVED = 8  #: further places for browsers in which a user has logged in before
NICENESS = 15


class TooManyChecks(Exception):
    """Too many passwords wait for their check."""


class PasswordCheck:
    """Queue of passwords that are checked one after the other."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._count = 0

    async def matches(self, password: str, expected: PasswordHash | None, is_known: bool) -> bool:
        """Return True if the password belongs to a hash. None belongs to no password, and takes as long.

        `is_known` states that the browser is known: a flood from many addresses does not use its places.

        Raises TooManyChecks.
        """
        if self._count >= MAX_WAITING + RESERVED * is_known:
            raise TooManyChecks
        self._count += 1
        try:
            async with self._turn:
                return await run_in_background(partial(_matches, password, expected or NO_PASSWORD))
        finally:
            self._count -= 1


def _matches(password: str, expected: PasswordHash) -> bool:
    reduce_priority(NICENESS, threading.get_native_id())
    return expected.matches(password)
