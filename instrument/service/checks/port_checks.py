"""Check of the ports of a configuration: their privilege, and the addresses on which they listen."""

from __future__ import annotations

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.checks.collisions import TcpPort, listening_ports
from pneuforce.instrument.service.checks.service_user import SERVICE_USER, service_permissions
from pneuforce.support.listening import has_address, may_listen
from pneuforce.support.permissions import user_name


def port_remarks(configuration: Configuration, user: str = SERVICE_USER) -> list[str]:
    """Return a clause for each port for which the user has no privilege, and for each missing address.

    No port is opened. Root checks the ports as the user of the service, if this user exists. The unit of the
    service may give the privilege, which this check does not detect.
    """
    ports, rdt = list(listening_ports(configuration)), configuration.rdt
    if rdt.enabled:
        ports.append(TcpPort("rdt.port", rdt.host, rdt.port))
    missing = [
        f"{port.key.removesuffix('port')}host = {port.host}: no interface of this computer has this address "
        "now: correct the address, or configure the network before the start"
        for port in ports
        if not has_address(port.host)
    ]
    with service_permissions(user):
        return missing + [
            f"{port.key} = {port.port}: {user_name()} may use this port only if the unit gives "
            "CAP_NET_BIND_SERVICE to the service (docs/service.md, Port 502)"
            for port in ports
            if not may_listen(port.port)
        ]
