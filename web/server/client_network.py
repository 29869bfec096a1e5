"""Network of a client: the unit to which the limits per address apply."""

from __future__ import annotations

from functools import lru_cache
from ipaddress import IPv6Address, ip_address, ip_network

IPV6_PREFIX_BITS = 64


@lru_cache(maxsize=1024)
def client_network(address: str) -> str:
    """Return the address, or the /64 network of an IPv6 address.

    One IPv6 host can use all addresses of its /64 network. A text that is not an address is returned
    unchanged.
    """
    try:
        parsed = ip_address(address)
    except ValueError:
        return address
    if isinstance(parsed, IPv6Address) and parsed.ipv4_mapped is None:
        return str(ip_network((int(parsed), IPV6_PREFIX_BITS), strict=False))
    return plain_address(address)


def plain_address(address: str) -> str:
    """Return an address as text. Return an IPv4 address that a dual-stack socket reports as IPv6 as IPv4."""
    try:
        parsed = ip_address(address)
    except ValueError:
        return address
    return str((parsed.ipv4_mapped or parsed) if isinstance(parsed, IPv6Address) else parsed)
