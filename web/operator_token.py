"""Verification of the operator's token, with a rate limit against guessing."""

from __future__ import annotations

import hmac
from collections import OrderedDict
from enum import Enum, auto
from ipaddress import IPv6Address, ip_address, ip_network

MAX_ATTEMPTS = 8  #: number of wrong tokens that one address may send before it must wait
ATTEMPT_PERIOD_S = 10.0  #: time until one further attempt is allowed
MAX_ADDRESSES = 1024
IPV6_PREFIX_BITS = 64


class TokenResult(Enum):
    """Result of the verification of a token."""

    VALID = auto()
    INVALID = auto()
    RATE_LIMITED = auto()  #: too many wrong tokens from this address; the token was not compared


class TokenVerifier:
    """Verifier that compares tokens with the configured token. An empty configured token matches no token.

    The rate limit per address is a leaky bucket. For each address, the time at which its bucket will be empty
    is stored.
    """

    def __init__(self, token: str) -> None:
        self._token = token.encode()
        self._bucket_empty_s: OrderedDict[str, float] = OrderedDict()

    @property
    def is_configured(self) -> bool:
        """Return True if a token is configured, so that operators can write."""
        return bool(self._token)

    def verify(self, token: object, address: str, now_s: float) -> TokenResult:
        """Compare a token that was received from `address`, and count the attempt if the token is wrong."""
        key = _rate_limit_key(address)
        empty_s = max(self._bucket_empty_s.get(key, now_s), now_s)
        if empty_s - now_s > (MAX_ATTEMPTS - 1) * ATTEMPT_PERIOD_S:
            return TokenResult.RATE_LIMITED
        if isinstance(token, str) and self.is_configured and self._equals(token):
            return TokenResult.VALID
        self._bucket_empty_s[key] = empty_s + ATTEMPT_PERIOD_S
        self._bucket_empty_s.move_to_end(key)
        if len(self._bucket_empty_s) > MAX_ADDRESSES:
            self._bucket_empty_s.popitem(last=False)
        return TokenResult.INVALID

    def _equals(self, token: str) -> bool:
        return hmac.compare_digest(token.encode("utf-8", "surrogatepass"), self._token)


def _rate_limit_key(address: str) -> str:
    """Return the address, or the /64 network of an IPv6 address.

    One IPv6 host can use all addresses of its /64 network.
    """
    try:
        parsed = ip_address(address)
    except ValueError:
        return address
    if isinstance(parsed, IPv6Address) and parsed.ipv4_mapped is None:
        return str(ip_network((int(parsed), IPV6_PREFIX_BITS), strict=False))
    return str(parsed)
