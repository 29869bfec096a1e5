"""Check of the ports of a configuration: whether the service needs a privilege to listen on them."""

from __future__ import annotations

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.checks.collisions import listening_ports
from pneuforce.instrument.service.checks.service_user import SERVICE_USER, service_permissions
from pneuforce.support.listening import may_listen
from pneuforce.support.permissions import user_name


def port_remarks(configuration: Configuration, user: str = SERVICE_USER) -> list[str]:
    """Return a clause for each port for which the user has no privilege. No port is opened.

    Root checks the ports as the user of the service, if this user exists. The unit of the service may give
    the privilege, which this check does not detect.
    """
    ports = [(port.key, port.port) for port in listening_ports(configuration)]
    if configuration.rdt.enabled:
        ports.append(("rdt.port", configuration.rdt.port))
    with service_permissions(user):
        return [
            f"{key} = {port}: {user_name()} may use this port only if the unit gives CAP_NET_BIND_SERVICE "
            "to the service (docs/service.md, Port 502)"
            for key, port in ports
            if not may_listen(port)
        ]
