"""Round-robin scheduler for client connections, with a time budget per pass of the event loop."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Protocol

#: Time for answers in each pass of the event loop. The rig, CAN and timers wait at most this long.
BUDGET_S = 0.004


class PendingClient(Protocol):
    """Client with at least one pending request."""

    def answer_next(self, now_s: float) -> bool:
        """Answer the next request. Return True if more requests are pending."""
        ...

    def send_answers(self) -> None:
        """Send the answers of this pass."""
        ...

    def pause_reading(self) -> None:
        """Stop reading from the client: its requests exceed the time budget of this pass."""
        ...


class RoundRobinScheduler:
    """Scheduler that answers one request per client in turn.

    Requests that exceed the time budget are answered in the next pass of the event loop.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._pending: deque[PendingClient] = deque()

    def add(self, client: PendingClient) -> None:
        """Queue a client that had no pending request until now. The client is served in the next pass."""
        if not self._pending:
            asyncio.get_running_loop().call_soon(self._run_pass)
        self._pending.append(client)

    def _run_pass(self) -> None:
        served = self._answer_requests()
        for client in served:
            client.send_answers()
        for client in self._pending:
            client.pause_reading()
        if self._pending:
            asyncio.get_running_loop().call_soon(self._run_pass)

    def _answer_requests(self) -> dict[PendingClient, None]:
        """Answer requests until none is pending or the budget is spent. Return the served clients in order.

        All requests of a pass are answered at the same instant, because nothing else runs in the meantime.
        """
        served: dict[PendingClient, None] = {}
        now_s = self._clock()
        while self._pending:
            client = self._pending.popleft()
            served[client] = None
            if client.answer_next(now_s):
                self._pending.append(client)
            if self._clock() >= now_s + BUDGET_S:
                break
        return served
