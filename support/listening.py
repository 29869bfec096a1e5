"""Reasons why a program cannot listen on a port, with their remedies."""

from __future__ import annotations

import errno
import re
import socket
from ipaddress import ip_address
from pathlib import Path

_FIRST_UNPRIVILEGED = Path("/proc/sys/net/ipv4/ip_unprivileged_port_start")
_STATUS = Path("/proc/thread-self/status")
_CAP_NET_BIND_SERVICE = 1 << 10


def listen_failure(error: OSError, section: str, port: int) -> str:
    """Return why no server can listen on a port, and the remedy in this section of the configuration."""
    if error.errno == errno.EADDRINUSE:
        return f"another program uses port {port}; end this program, or change [{section}] port"
    if needs_privilege(error):
        return f"port {port} needs a privilege; {privilege_remedy(section)}"
    return f"{error.strerror or error}; correct [{section}] host, or set [{section}] enabled = false"


def needs_privilege(error: OSError) -> bool:
    """Return True if a program cannot listen because only privileged programs may use the port."""
    return error.errno == errno.EACCES


def privilege_remedy(section: str) -> str:
    """Return what to do if a program has no privilege for the port of a section."""
    return (
        f"change [{section}] port to {first_unprivileged_port()} or higher, or give the service "
        "CAP_NET_BIND_SERVICE (docs/service.md, Port 502)"
    )


def may_listen(port: int) -> bool:
    """Return True if this process has the privilege that a port needs. No port is opened."""
    if port == 0 or port >= first_unprivileged_port():
        return True
    try:
        effective = re.search(r"^CapEff:\s*([0-9a-f]+)$", _STATUS.read_text(), re.MULTILINE)
    except OSError:  # /proc is not mounted: only the start of the server shows the truth
        return True
    return effective is None or bool(int(effective[1], 16) & _CAP_NET_BIND_SERVICE)


def has_address(host: str) -> bool:
    """Return False if no interface of this computer has an IP address now; True for other host names.

    A host name is not looked up, because this could need a connection to a name server.
    """
    try:
        ip_address(host)
        kind, protocol, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_DGRAM)[0]
        with socket.socket(kind, protocol) as probe:
            probe.bind(address)
    except ValueError:
        return True
    except OSError as error:
        return error.errno != errno.EADDRNOTAVAIL
    return True


def first_unprivileged_port() -> int:
    """Return the lowest port that every program may use."""
    try:
        return int(_FIRST_UNPRIVILEGED.read_text())
    except (OSError, ValueError):
        return 1024
