"""Check that no TCP port and no file is used twice in a configuration."""

from __future__ import annotations

import os
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from pneuforce.instrument.config import (
    Configuration,
    ModbusSection,
    ModbusSecuritySection,
    WebSection,
)
from pneuforce.instrument.service.checks.configured_files import ConfiguredFile, configured_files
from pneuforce.support.network_name import WILDCARDS, is_socket_url

_LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})


class TcpPort(NamedTuple):
    """TCP address that the instrument uses. `key` is the configuration key of the port."""

    key: str
    host: str
    port: int

    def collides_with(self, other: TcpPort) -> bool:
        """Return True if both addresses cannot be used at the same time."""
        hosts = {self.host, other.host}
        same = len(hosts) == 1 or hosts <= _LOOPBACK or hosts & WILDCARDS
        return self.port == other.port and bool(same)


def collisions(configuration: Configuration, path: Path) -> Iterator[str]:
    """Yield a clause for each TCP port or file that two enabled parts of a configuration use.

    `path` is the configuration file, to which the names of files are relative.
    """
    yield from _port_collisions(configuration)
    yield from _file_collisions(configuration, path)


def collision(first: str, second: str, what: str) -> str:
    """Return the clause about two configuration keys that name the same port, file or other resource."""
    return f"{first} and {second} are both {what}: change one of them"


def _port_collisions(configuration: Configuration) -> Iterator[str]:
    for first, second in combinations(_tcp_ports(configuration), 2):
        if first.collides_with(second):
            yield collision(first.key, second.key, f"the TCP port {first.port}")


def _file_collisions(configuration: Configuration, path: Path) -> Iterator[str]:
    for first, second in combinations(configured_files(configuration, path), 2):
        if is_same_written_file(first, second):
            yield collision(first.key, second.key, os.path.realpath(first.path))


def is_same_written_file(first: ConfiguredFile, second: ConfiguredFile) -> bool:
    """Return True if both are one file, and at least one of them is written. Reading can be shared."""
    same = os.path.realpath(first.path) == os.path.realpath(second.path)
    return same and (first.is_written or second.is_written)


def listening_ports(configuration: Configuration) -> Iterator[TcpPort]:
    """Yield the TCP ports on which the instrument listens."""
    sections: dict[str, ModbusSection | ModbusSecuritySection | WebSection] = {
        "modbus.port": configuration.modbus,
        "modbus_security.port": configuration.modbus_security,
        "web.port": configuration.web,
    }
    for key, section in sections.items():
        if section.enabled:
            yield TcpPort(key, section.host, section.port)


def _tcp_ports(configuration: Configuration) -> Iterator[TcpPort]:
    """Yield the ports on which the instrument listens, and the ports of servers on this computer."""
    yield from listening_ports(configuration)
    rig, can = configuration.rig, configuration.can
    servers = (
        [TcpPort("can.port", can.host, can.port)] if can.enabled and can.interface == "socketcand" else []
    )
    if is_socket_url(rig.port):
        url = urlsplit(rig.port)
        servers.append(TcpPort("rig.port", url.hostname or "", url.port or 0))
    yield from (server for server in servers if server.host in _LOOPBACK)
