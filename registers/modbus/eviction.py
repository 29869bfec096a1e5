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
MIN_SHARE = 2  #: connections that an address may have even if there are many addresses


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

    def history_s(self, now_s: float) -> float:
        """Return the time since the first request [s]. For an idle client, the time ends at the last one."""
        if not self.count:
            return 0.0
        polls = self.activity(now_s) is Activity.POLLING
        return (now_s if polls else self.last_s) - self.first_s


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
    activity, an address that exceeds its share comes first: of such addresses, the one with the most
    connections. Then the client with the shortest history comes first, and at last the client that was silent
    for longest.

    The share divides the connections equally among the addresses. A client with a long history is therefore
    safe from newcomers, and many clients of one address cannot use their history against other addresses.
    """
    candidates = list(connections)
    per_address = Counter((*(c.address for c in candidates), new_address))
    share = max(MIN_SHARE, len(candidates) // len(per_address))

    def order(c: C) -> tuple[Activity, int, float, float]:
        count = per_address[c.address]
        above_share = count if count > share else 0
        return c.rhythm.activity(now_s), -above_share, c.rhythm.history_s(now_s), c.last_received_s

    return min(candidates, key=order)
