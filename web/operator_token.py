"""Verification of the operator's token, with a rate limit against guessing.

The limit belongs to a client: an address, or a browser that has logged in before (`known_browsers.py`). After
`MAX_ATTEMPTS` wrong tokens, one token of the client is compared every `ATTEMPT_PERIOD_S`.

Several persons can share one address, for example with an SSH tunnel. If the first token after each period
were compared, a program that sends many wrong tokens would use every comparison. An operator at the same
address could then never log in. Therefore the tokens wait in a list:

- A token gets the last place when it is received first. If it is received again, it keeps its place.
- A token that is not received again within `PLACE_TIMEOUT_S` loses its place.
- Only the token at the first place is compared.

The page sends the token of the operator again until the token is compared. The longest wait depends on the
wrong tokens that other clients at the address send:

- all different, or all equal: 2 * `ATTEMPT_PERIOD_S` + `PLACE_TIMEOUT_S`;
- n tokens that are repeated, so that all keep their places: (n + 1) * `ATTEMPT_PERIOD_S` + `PLACE_TIMEOUT_S`.

A browser that has logged in before does not wait. For other clients, a shorter wait needs more comparisons,
because a guess cannot be distinguished from the right token before the comparison.
"""

from __future__ import annotations

import hashlib
import hmac
from collections import OrderedDict
from dataclasses import dataclass, field
from enum import Enum, auto
from itertools import islice

MAX_ATTEMPTS = 8  #: number of wrong tokens that one client may send before it must wait
ATTEMPT_PERIOD_S = 10.0  #: time until one further attempt is allowed
PLACE_TIMEOUT_S = 12.0  #: a waiting token loses its place if it is not sent again within this time
CLEANING_PERIOD_S = 1.0
MAX_CLIENTS = 1024


class TokenResult(Enum):
    """Result of the verification of a token."""

    VALID = auto()
    INVALID = auto()
    RATE_LIMITED = auto()  #: too many wrong tokens from this client; the token was not compared


@dataclass(slots=True)
class _ClientLimit:
    """Rate limit of one client: a leaky bucket of wrong tokens, and the tokens that wait for a comparison."""

    bucket_empty_s: float = 0.0
    #: Digests of the waiting tokens in the order of their places, with the time of the last reception.
    waiting: dict[bytes, float] = field(default_factory=dict)

    def comparisons(self, now_s: float) -> int:
        """Return the number of comparisons that are possible now."""
        return int(MAX_ATTEMPTS - max(0.0, self.bucket_empty_s - now_s) / ATTEMPT_PERIOD_S)

    def take_turn(self, token: bytes, now_s: float) -> bool:
        """Return True if the token may be compared now. Otherwise the token waits."""
        self.waiting[token] = now_s
        is_first = token in islice(self.waiting, self.comparisons(now_s))
        if is_first:
            del self.waiting[token]
        return is_first

    def count_wrong_token(self, now_s: float) -> None:
        self.bucket_empty_s = max(self.bucket_empty_s, now_s) + ATTEMPT_PERIOD_S

    def remove_old(self, now_s: float) -> None:
        self.waiting = {
            token: last_s for token, last_s in self.waiting.items() if now_s - last_s <= PLACE_TIMEOUT_S
        }


class TokenVerifier:
    """Verifier that compares tokens with the configured token. An empty configured token matches no token."""

    def __init__(self, token: str) -> None:
        self._token = token.encode()
        self._limits: OrderedDict[str, _ClientLimit] = OrderedDict()
        self._cleaned_s = 0.0

    @property
    def is_configured(self) -> bool:
        """Return True if a token is configured, so that operators can write."""
        return bool(self._token)

    def verify(self, token: object, client: str, now_s: float) -> TokenResult:
        """Compare a token that was received from `client`, and count the attempt if the token is wrong.

        A token that is not a text is always invalid and is not counted.
        """
        if not isinstance(token, str):
            return TokenResult.INVALID
        self._remove_old(now_s)
        limit = self._limits.setdefault(client, _ClientLimit())
        self._limits.move_to_end(client)
        if len(self._limits) > MAX_CLIENTS:
            self._limits.popitem(last=False)
        encoded = token.encode("utf-8", "surrogatepass")
        if not limit.take_turn(hashlib.sha256(encoded).digest(), now_s):
            return TokenResult.RATE_LIMITED
        if self.is_configured and hmac.compare_digest(encoded, self._token):
            return TokenResult.VALID
        limit.count_wrong_token(now_s)
        return TokenResult.INVALID

    def _remove_old(self, now_s: float) -> None:
        """Remove waiting tokens that have lost their places, and clients without a limit."""
        if now_s - self._cleaned_s < CLEANING_PERIOD_S:
            return
        self._cleaned_s = now_s
        for client, limit in list(self._limits.items()):
            limit.remove_old(now_s)
            if not limit.waiting and limit.bucket_empty_s <= now_s:
                del self._limits[client]
