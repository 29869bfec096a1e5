"""Turns: all clients are answered in a round-robin, within one time budget per pass of the loop."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Protocol

#: For answering, of each pass of the loop: what else it drives (the rig, CAN, time) waits no longer for it.
BUDGET_S = 0.004


class Waiter(Protocol):
    """A client with at least one request waiting."""

    def take_turn(self, now_s: float) -> bool:
        """Answer one request; whether more are waiting."""
        ...

    def end_pass(self) -> None:
        """Send the answers of this pass."""
        ...

    def hold(self) -> None:
        """The budget is spent and requests are left: take in no more of them."""
        ...


class Turns:
    """One request of each client in its turn; what is over the budget is answered in the next pass."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._waiting: deque[Waiter] = deque()

    def join(self, waiter: Waiter) -> None:
        """Queue a client that had no request waiting until now; it is served in the next pass."""
        if not self._waiting:
            asyncio.get_running_loop().call_soon(self._pass)
        self._waiting.append(waiter)

    def _pass(self) -> None:
        served = self._serve()
        for waiter in served:
            waiter.end_pass()
        for waiter in self._waiting:
            waiter.hold()
        if self._waiting:
            asyncio.get_running_loop().call_soon(self._pass)

    def _serve(self) -> dict[Waiter, None]:
        """Serve until nobody waits or the budget is spent; who was served, in order.

        All are served at one instant, that of the pass: nothing else happens meanwhile.
        """
        served: dict[Waiter, None] = {}
        now_s = self._clock()
        while self._waiting:
            waiter = self._waiting.popleft()
            served[waiter] = None
            if waiter.take_turn(now_s):
                self._waiting.append(waiter)
            if self._clock() >= now_s + BUDGET_S:
                break
        return served
