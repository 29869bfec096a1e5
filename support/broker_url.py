"""URL of an MQTT broker: `mqtt://host:port`, or `mqtts://host:port` with TLS."""

from __future__ import annotations

import re
from typing import NamedTuple

from pneuforce.support.network_name import MAX_PORT, is_host

_PORTS = {"mqtt": 1883, "mqtts": 8883}
_URL = re.compile(
    r"(?P<scheme>mqtts?)://(\[(?P<address>[^][]+)]|(?P<name>[^]/?#:@[]+))(:(?P<port>[0-9]{1,5}))?/?"
)


class BrokerAddress(NamedTuple):
    """Address of a broker."""

    host: str
    port: int
    tls: bool


def broker_address(url: str) -> BrokerAddress:
    """Return the address in a URL. Raises ValueError with the allowed form."""
    match = _URL.fullmatch(url)
    host = "" if match is None else match["address"] or match["name"]
    port = 0 if match is None else int(match["port"] or _PORTS[match["scheme"]])
    if match is None or not is_host(host) or not 1 <= port <= MAX_PORT:
        raise ValueError(
            "this is not mqtt://host:port or mqtts://host:port (user and password have own keys)"
        )
    return BrokerAddress(host, port, match["scheme"] == "mqtts")
