"""Eviction: selection of the connection that is closed for a new one. Time is an argument."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol, TypeVar

MIN_POLLS = 3  #: number of requests from which the interval between two requests is known
#: A client polls if its last request is not older than this number of its usual intervals.
MAX_MISSED_POLLS = 3
MIN_SILENCE_S = 0.5  #: shorter silences say nothing about a client that polls faster
SMOOTHING = 0.25  #: weight of the latest interval in the usual interval


class Activity(IntEnum):
    """Activity of a client. A client with a lower value is evicted first."""

    NO_REQUEST = 0  #: has not completed a request
    IDLE = 1
    POLLING = 2  #: sends requests regularly


@dataclass(slots=True)
class RequestRhythm:
    """Times of the requests on one connection."""

    count: int = 0
    first_s: float = math.inf
    last_s: float = -math.inf
    _interval_s: float = 0.0

    def add(self, now_s: float) -> None:
        """Record one or several requests that were received together."""
        if self.count:
            weight = SMOOTHING if self.count > 1 else 1.0
            self._interval_s += weight * (now_s - self.last_s - self._interval_s)
        else:
            self.first_s = now_s
        self.count += 1
        self.last_s = now_s

    def activity(self, now_s: float) -> Activity:
        """Return the activity at the time `now_s`."""
        if not self.count:
            return Activity.NO_REQUEST
        expected_s = max(MAX_MISSED_POLLS * self._interval_s, MIN_SILENCE_S)
        polls = self.count >= MIN_POLLS and now_s - self.last_s <= expected_s
        return Activity.POLLING if polls else Activity.IDLE


class Candidate(Protocol):
    """Connection that can be evicted."""

    rhythm: RequestRhythm
    last_received_s: float

    @property
    def address(self) -> str:
        """Return the IP address of the client."""
        ...


C = TypeVar("C", bound=Candidate)


def select_evicted(connections: Iterable[C], new_address: str, now_s: float) -> C:
    """Return the connection to close for a new connection from `new_address`.

    Clients without a request come first, then idle clients, then clients that poll. Among clients of equal
    activity, the address with the most connections comes first. Of this address, the client that was silent
    for longest is selected. If all clients of the address poll, the latest client is selected.
    """
    candidates = list(connections)
    per_address = Counter((*(c.address for c in candidates), new_address))

    def order(c: C) -> tuple[Activity, int, float]:
        activity = c.rhythm.activity(now_s)
        age = -c.rhythm.first_s if activity is Activity.POLLING else c.last_received_s
        return activity, -per_address[c.address], age

    return min(candidates, key=order)
