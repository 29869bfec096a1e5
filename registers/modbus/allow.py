"""Who may connect: a firewall of the instrument's own, before any request is read."""

from __future__ import annotations

from collections.abc import Iterable
from ipaddress import IPv6Address, ip_address, ip_network

#: This machine itself; it always gets in.
_OWN = frozenset((ip_address("127.0.0.1"), ip_address("::1")))


class AllowList:
    """Addresses that may connect: 127.0.0.1, ::1, and those in `networks`; all, where that is empty."""

    def __init__(self, networks: Iterable[str]) -> None:
        """Raises ValueError where one of `networks` is neither an address nor a network."""
        self._networks = [ip_network(network) for network in networks]

    def admits(self, address: str) -> bool:
        """Whether a client at `address`, as its socket tells it, may connect."""
        if not self._networks:
            return True
        try:
            its = ip_address(address)
        except ValueError:  # gone before it was known
            return False
        if isinstance(its, IPv6Address):
            its = its.ipv4_mapped or its  # of a socket that listens to both families
        return its in _OWN or any(its in network for network in self._networks)
