"""Eviction: order in which the connections of one address are closed for new ones. Time is an argument.

The connection of an operator must stay open until the answer to a vent.

- A connection with a vent in progress is never closed.
- All other connections are closed in the order of their last progress. The progress of a connection is its
  start, a complete request head, or an answer.
- While the request head is incomplete, the progress of a connection counts as `HEAD_ADVANTAGE_S` later. A
  client has this time to send the head of a vent, even if other clients hold all other connections. The time
  is shorter only if other clients start `MAX_CONNECTIONS_PER_ADDRESS` connections or requests in this time.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from enum import Enum, auto
from typing import Generic, TypeVar

#: Additional time for a connection with an incomplete request head, or with an answer in progress.
HEAD_ADVANTAGE_S = 3.0


class Protection(Enum):
    """Protection of a connection against eviction."""

    NONE = auto()  #: idle, or the body of the request is incomplete, or the client does not read the answer
    LATER = auto()  #: the request head is incomplete, or an answer is in progress
    FULL = auto()  #: a vent is in progress, or an event stream is open


Connection = TypeVar("Connection")


class EvictionQueue(Generic[Connection]):
    """Connections of one address, in the order of eviction."""

    def __init__(self) -> None:
        #: For each protection, its connections and the times at which they got it, oldest first.
        self._since_s: dict[Protection, dict[Connection, float]] = {each: {} for each in Protection}

    def __len__(self) -> int:
        return sum(map(len, self._since_s.values()))

    def place(self, connection: Connection, protection: Protection, now_s: float) -> None:
        """Add a connection, or change its protection. Do nothing if the protection is unchanged."""
        if connection not in self._since_s[protection]:
            self.remove(connection)
            self._since_s[protection][connection] = now_s

    def remove(self, connection: Connection) -> None:
        """Remove a connection that is closed."""
        for connections in self._since_s.values():
            connections.pop(connection, None)

    def candidates(self) -> Iterator[Connection]:
        """Yield the connections that may be closed, in the order of eviction."""
        unprotected = ((since_s, c) for c, since_s in self._since_s[Protection.NONE].items())
        later = ((since_s + HEAD_ADVANTAGE_S, c) for c, since_s in self._since_s[Protection.LATER].items())
        return (c for _, c in heapq.merge(unprotected, later, key=lambda item: item[0]))
