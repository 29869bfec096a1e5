"""Address of a host name, for the message of a client that could not connect."""

from __future__ import annotations

import socket


def address_problem(host: str) -> str:
    """Return why `host` has no address, for example a misspelled name; "" if it has one.

    The result takes as long as the name service needs, so call this function only after a failed connection.
    """
    try:
        socket.getaddrinfo(host, None)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or "not a host name"
        return f"the host name {host} has no address: {reason}. Check the name"
    return ""
