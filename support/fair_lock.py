"""Lock that threads get in the order of their requests."""

from __future__ import annotations

import threading
from collections import deque
from types import TracebackType


class FairLock:
    """Lock for `with` statements, which its owner can take again.

    A thread that releases a lock of the standard library and requests it again at once usually gets it
    again, so that other threads can wait for seconds. This lock goes to the thread that waits longest.
    """

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._waiting: deque[tuple[int, threading.Lock]] = deque()
        self._owner: int | None = None
        self._depth = 0

    def __enter__(self) -> FairLock:
        me = threading.get_ident()
        with self._guard:
            if self._owner in (None, me):
                self._owner, self._depth = me, self._depth + 1
                return self
            gate = threading.Lock()
            gate.acquire()
            self._waiting.append((me, gate))
        try:
            gate.acquire()  # until the owner before this thread releases the lock
        except BaseException:  # for example Ctrl-C
            self._give_up((me, gate))
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._guard:
            self._release()

    def _release(self) -> None:
        self._depth -= 1
        if self._depth:
            return
        if not self._waiting:
            self._owner = None
            return
        self._owner, gate = self._waiting.popleft()
        self._depth = 1
        gate.release()

    def _give_up(self, request: tuple[int, threading.Lock]) -> None:
        """Remove a request. If it has already received the lock, release the lock."""
        with self._guard:
            if request in self._waiting:
                self._waiting.remove(request)
            else:
                self._release()
