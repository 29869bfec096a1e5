"""Allow list of network addresses, checked before any request is read."""

from __future__ import annotations

from collections.abc import Iterable
from ipaddress import IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network

#: Addresses of this machine, which are always allowed.
_LOOPBACK = frozenset((ip_address("127.0.0.1"), ip_address("::1")))


class AllowList:
    """Addresses that may connect: 127.0.0.1, ::1 and those in `networks`. An empty list allows all."""

    def __init__(self, networks: Iterable[str]) -> None:
        """Parse the networks. Raises ValueError if an item is neither an address nor a network."""
        self._networks = [parse_network(network) for network in networks]

    def admits(self, address: str) -> bool:
        """Return True if a client at `address`, as its socket reports it, may connect."""
        if not self._networks:
            return True
        try:
            client = ip_address(address)
        except ValueError:  # the client disconnected before its address was read
            return False
        if isinstance(client, IPv6Address):
            client = client.ipv4_mapped or client  # a dual-stack socket reports IPv4 clients as IPv6
        return client in _LOOPBACK or any(client in network for network in self._networks)


def parse_network(text: str) -> IPv4Network | IPv6Network:
    """Return a network. Raises ValueError if the text is neither an address nor a network."""
    network = ip_network(text, strict=False)
    if "/" in text and network.network_address != ip_address(text.partition("/")[0]):
        raise ValueError(f"{text} is an address within a network: write the network {network}")
    return network
