"""Limit of handshakes in progress. The oldest handshake of the address with the most handshakes is ended."""

from __future__ import annotations

import asyncio
from collections import Counter

MAX_PENDING = 64


class PendingHandshakes:
    """Handshakes in progress, at most MAX_PENDING.

    A client that opens connections without completing a handshake ends its own older connections, so that
    other addresses can still connect.
    """

    def __init__(self, maximum: int = MAX_PENDING) -> None:
        self._maximum = maximum
        self._addresses: dict[asyncio.Task[None], str] = {}  #: in the order of their start

    def __len__(self) -> int:
        return len(self._addresses)

    def add(self, task: asyncio.Task[None], address: str) -> None:
        """Add a handshake. If there are too many, cancel another one."""
        if len(self._addresses) >= self._maximum:
            self._cancel_one()
        self._addresses[task] = address

    def remove(self, task: asyncio.Task[None]) -> None:
        """Remove a handshake that has ended."""
        self._addresses.pop(task, None)

    def _cancel_one(self) -> None:
        counts = Counter(self._addresses.values())
        most = max(counts.values())
        task = next(task for task, address in self._addresses.items() if counts[address] == most)
        del self._addresses[task]
        task.cancel()
