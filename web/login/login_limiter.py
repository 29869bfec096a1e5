"""Rate limit of login attempts, against guessing.

The limit belongs to a client: an address, or a browser that has logged in before (`known_browsers.py`). After
`MAX_ATTEMPTS` wrong passwords, one password of the client is compared every `ATTEMPT_PERIOD_S`.

Several persons can share one address, for example with an SSH tunnel. If the first attempt after each period
were compared, a program that sends many wrong passwords would use every comparison. An operator at the same
address could then never log in. Therefore the attempts wait in a list:

- An attempt gets the last place when it is received first. If it is received again, it keeps its place.
- An attempt that is not received again within `PLACE_TIMEOUT_S` loses its place.
- Only the attempt at the first place is compared.

The page sends the attempt of the operator again until it is compared. The longest wait depends on the wrong
attempts that other clients at the address send:

- all different, or all equal: 2 * `ATTEMPT_PERIOD_S` + `PLACE_TIMEOUT_S`;
- n attempts that are repeated, so that all keep their places: (n + 1) * `ATTEMPT_PERIOD_S` +
  `PLACE_TIMEOUT_S`.

A browser that has logged in before does not wait. For other clients, a shorter wait needs more comparisons,
because a guess cannot be distinguished from the right password before the comparison.
"""

from __future__ import annotations

import hashlib
import secrets
from collections import OrderedDict
from dataclasses import dataclass, field
from itertools import islice

MAX_ATTEMPTS = 8  #: number of wrong passwords that one client may send before it must wait
ATTEMPT_PERIOD_S = 10.0  #: time until one further attempt is allowed
PLACE_TIMEOUT_S = 12.0  #: a waiting attempt loses its place if it is not sent again within this time
CLEANING_PERIOD_S = 1.0
MAX_CLIENTS = 1024


@dataclass(slots=True)
class _ClientLimit:
    """Rate limit of one client: a leaky bucket of attempts, and the attempts that wait for a comparison."""

    bucket_empty_s: float = 0.0
    #: Digests of the waiting attempts in the order of their places, with the time of the last reception.
    waiting: dict[bytes, float] = field(default_factory=dict)

    def comparisons(self, now_s: float) -> int:
        """Return the number of comparisons that are possible now."""
        return int(MAX_ATTEMPTS - max(0.0, self.bucket_empty_s - now_s) / ATTEMPT_PERIOD_S)

    def take_turn(self, attempt: bytes, now_s: float) -> bool:
        """Return True and count the attempt if it may be compared now. Otherwise the attempt waits."""
        self.waiting[attempt] = now_s
        is_first = attempt in islice(self.waiting, self.comparisons(now_s))
        if is_first:
            del self.waiting[attempt]
            self.bucket_empty_s = max(self.bucket_empty_s, now_s) + ATTEMPT_PERIOD_S
        return is_first

    def remove_old(self, now_s: float) -> None:
        self.waiting = {
            attempt: last_s for attempt, last_s in self.waiting.items() if now_s - last_s <= PLACE_TIMEOUT_S
        }


class LoginLimiter:
    """Rate limits of all clients. Time is an argument."""

    def __init__(self) -> None:
        self._key = secrets.token_bytes(32)  # so that the digests do not reveal a password
        self._limits: OrderedDict[str, _ClientLimit] = OrderedDict()
        self._cleaned_s = 0.0

    def take_turn(self, client: str, name: str, password: str, now_s: float) -> bool:
        """Return True if the password that `client` has sent may be compared now.

        The attempt is counted at once, because the comparison takes some time and other attempts may follow.
        """
        self._remove_old(now_s)
        limit = self._limits.setdefault(client, _ClientLimit())
        self._limits.move_to_end(client)
        if len(self._limits) > MAX_CLIENTS:
            self._limits.popitem(last=False)
        text = f"{name}\0{password}".encode("utf-8", "surrogatepass")
        return limit.take_turn(hashlib.blake2b(text, key=self._key).digest(), now_s)

    def take_back(self, client: str) -> None:
        """Do not count an attempt that was right, or that could not be compared."""
        if limit := self._limits.get(client):
            limit.bucket_empty_s -= ATTEMPT_PERIOD_S

    def _remove_old(self, now_s: float) -> None:
        """Remove waiting attempts that have lost their places, and clients without a limit."""
        if now_s - self._cleaned_s < CLEANING_PERIOD_S:
            return
        self._cleaned_s = now_s
        for client, limit in list(self._limits.items()):
            limit.remove_old(now_s)
            if not limit.waiting and limit.bucket_empty_s <= now_s:
                del self._limits[client]
