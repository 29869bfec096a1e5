"""The operator's token, and how slowly it can be guessed."""

from __future__ import annotations

import hmac
from collections import OrderedDict
from enum import Enum, auto
from ipaddress import IPv6Address, ip_address, ip_network

TRIES = 8  #: wrong ones that an address has at once
TRY_AGAIN_S = 10.0  #: then one in this time
MOST_ADDRESSES = 1024


class Verdict(Enum):
    """What is to be said of a token."""

    RIGHT = auto()
    WRONG = auto()
    WAIT = auto()  #: too many wrong ones from that address: this one was not looked at


class Tokens:
    """Knows the one token that allows to write; an empty one allows nobody."""

    def __init__(self, token: str) -> None:
        self._token = token.encode()
        self._clear_s: OrderedDict[str, float] = (
            OrderedDict()
        )  # when each address will have all its tries again

    @property
    def writable(self) -> bool:
        """Whether there is a token at all."""
        return bool(self._token)

    def judge(self, given: object, address: str, now_s: float) -> Verdict:
        """Look at a token that came from `address`."""
        whose = _neighbourhood(address)
        clear_s = max(self._clear_s.get(whose, now_s), now_s)
        if clear_s - now_s > (TRIES - 1) * TRY_AGAIN_S:
            return Verdict.WAIT
        if isinstance(given, str) and self.writable and self._equals(given):
            return Verdict.RIGHT
        self._clear_s[whose] = clear_s + TRY_AGAIN_S
        self._clear_s.move_to_end(whose)
        if len(self._clear_s) > MOST_ADDRESSES:
            self._clear_s.popitem(last=False)
        return Verdict.WRONG

    def _equals(self, given: str) -> bool:
        return hmac.compare_digest(given.encode("utf-8", "surrogatepass"), self._token)


def _neighbourhood(address: str) -> str:
    """Whose address it is: of IPv6 the network of 64 bits, in which anybody has addresses without end."""
    try:
        its = ip_address(address)
    except ValueError:
        return address
    if isinstance(its, IPv6Address) and its.ipv4_mapped is None:
        return str(ip_network((int(its), 64), strict=False))
    return str(its)
