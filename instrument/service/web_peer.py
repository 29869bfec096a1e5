"""Addresses of browsers in the entries of the web process."""

from __future__ import annotations

from typing import Any, NamedTuple

from pneuforce.instrument.stream.entry import StreamEntry, StreamError
from pneuforce.registers.source import Peer

MAX_TEXT = 64  #: longest address or reason
MAX_TIMES = 10**9


class FailedLoginReport(NamedTuple):
    """Number of failed logins of one peer with the same reason."""

    peer: Peer
    reason: str
    times: int


def web_peer(facts: dict[str, Any]) -> Peer:
    """Return the peer of an entry of the web process. Raises StreamError if the address is invalid."""
    return Peer("web", _text(facts.get("address", "")))


def parse_failed_login(entry: StreamEntry) -> FailedLoginReport:
    """Return the report in an entry of the kind FAILED_LOGIN. Raises StreamError if the entry is invalid."""
    facts = entry.json_body
    times = facts.get("times") if isinstance(facts, dict) else None
    if not isinstance(times, int) or not 1 <= times <= MAX_TIMES:
        raise StreamError("the number of failed logins is missing or invalid")
    return FailedLoginReport(web_peer(facts), _text(facts.get("reason")), times)


def _text(value: object) -> str:
    if not isinstance(value, str) or len(value) > MAX_TEXT or not (value.isascii() and value.isprintable()):
        raise StreamError("an address or a reason is missing or invalid")
    return value
