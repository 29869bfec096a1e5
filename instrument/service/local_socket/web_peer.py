"""Addresses of browsers, events of users and addresses of MQTT brokers in the entries of child processes."""

from __future__ import annotations

from typing import Any, NamedTuple

from pneuforce.instrument.stream.entry import StreamEntry, StreamError
from pneuforce.registers.source import Peer

MAX_TEXT = 80  #: longest `name@address`, address or reason
MAX_TIMES = 10**9


class LoginReport(NamedTuple):
    """Login, logout, or number of failed logins with the same reason, of one peer."""

    kind: str
    peer: Peer
    result: str
    user: str
    times: int

    @property
    def has_failed(self) -> bool:
        """Return True for failed logins."""
        return self.kind == "login" and self.result != "accepted"


def peer_of(facts: dict[str, Any], channel: str = "web") -> Peer:
    """Return the peer of an entry of a child process: `address`, or `name@address` of a user of the web page.

    Raises StreamError if the address is invalid.
    """
    return Peer(channel, _text(facts.get("address", "")))


def parse_login(entry: StreamEntry) -> LoginReport:
    """Return the report in an entry of the kind LOGIN. Raises StreamError if the entry is invalid."""
    facts = entry.json_body
    times = facts.get("times") if isinstance(facts, dict) else None
    if not isinstance(times, int) or not 1 <= times <= MAX_TIMES:
        raise StreamError("the number of logins is missing or invalid")
    if facts.get("kind") not in ("login", "logout"):
        raise StreamError("an event of a user is neither a login nor a logout")
    return LoginReport(
        facts["kind"], peer_of(facts), _text(facts.get("result")), _text(facts.get("user")), times
    )


def _text(value: object) -> str:
    if not isinstance(value, str) or len(value) > MAX_TEXT or not (value.isascii() and value.isprintable()):
        raise StreamError("an address or a reason is missing or invalid")
    return value
