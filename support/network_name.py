"""Syntax of host names, IP addresses and URLs of TCP connections."""

from __future__ import annotations

import re
from ipaddress import ip_address

MAX_HOST_CHARACTERS = 253
MAX_PORT = 65535
#: Hosts that stand for every address of a computer. A server listens on them, and no client connects to them.
WILDCARDS = frozenset({"0.0.0.0", "::"})
_LABEL = r"[A-Za-z0-9_]([A-Za-z0-9_-]{0,61}[A-Za-z0-9_])?"
_NAME = re.compile(rf"{_LABEL}(\.{_LABEL})*\.?")
_SOCKET_URL = re.compile(r"socket://(\[(?P<address>[^][]+)]|(?P<name>[^]/?#:@[]+)):(?P<port>[0-9]{1,5})")


def is_host(text: str) -> bool:
    """Return True if `text` is an IP address or a host name (RFC 1123, and with underscores).

    For other texts, functions of Python's standard library raise UnicodeError instead of OSError.
    """
    if not text.isascii() or not text.isprintable() or len(text) > MAX_HOST_CHARACTERS:
        return False
    try:
        ip_address(text)
    except ValueError:
        return _NAME.fullmatch(text) is not None
    return True


def is_socket_url(text: str) -> bool:
    """Return True if `text` is `socket://host:port`, with an IPv6 address in brackets."""
    match = _SOCKET_URL.fullmatch(text)
    return (
        match is not None
        and is_host(match["address"] or match["name"])
        and 1 <= int(match["port"]) <= MAX_PORT
    )
