"""Checks of the texts in a configuration file. Each check returns its text, or raises ValueError."""

from __future__ import annotations

import re
from ipaddress import ip_address
from typing import Annotated

from pydantic import AfterValidator, ValidationInfo

from pneuforce.registers.rights import RIGHTS
from pneuforce.support.allow_list import parse_network
from pneuforce.support.broker_url import broker_address
from pneuforce.support.network_name import is_host
from pneuforce.support.serial_port import is_port_name

_CHANNEL = re.compile(r"[^\s/<>]+")


def check_text(text: str) -> str:
    """Return `text`. Raises ValueError if it contains a control character or another invisible character."""
    for character in text:
        if not character.isprintable():
            raise ValueError(f"the text contains the invisible character U+{ord(character):04X}: remove it")
    return text


Text = Annotated[str, AfterValidator(check_text)]


def check_host(text: str) -> str:
    """Return `text`. Raises ValueError if it is neither an IP address nor a host name."""
    if not is_host(check_text(text)):
        raise ValueError("this is neither an IP address nor a host name")
    return text


def check_rig_port(text: str) -> str:
    """Return `text`. Raises ValueError if it is neither a device nor `socket://host:port`."""
    if not is_port_name(check_text(text)):
        raise ValueError("the only URL that may be used is socket://host:port")
    return text


def check_channel(text: str) -> str:
    """Return `text`. Raises ValueError if it cannot be the name of a CAN interface."""
    if not _CHANNEL.fullmatch(check_text(text)):
        raise ValueError("the name of a CAN interface contains neither spaces nor the characters / < >")
    return text


def check_network(text: str) -> str:
    """Return `text`. Raises ValueError if it is not an IP address or network."""
    parse_network(check_text(text))
    return text


def check_broker(text: str) -> str:
    """Return `text`. Raises ValueError if it is not the URL of an MQTT broker."""
    broker_address(check_text(text))
    return text


def check_topic_part(text: str) -> str:
    """Return `text`. Raises ValueError if it contains a character with a meaning in topics of MQTT."""
    if found := sorted(set(check_text(text)) & set("/+#")):
        raise ValueError(f"the name contains {' '.join(found)}, which has a meaning in topics: remove it")
    return text


def check_allow(allow: list[str], section: ValidationInfo) -> list[str]:
    """Return `allow`. Raises ValueError if the list is empty and `host` can be reached from the network."""
    host = section.data.get("host", "localhost")  # an invalid host has its own error message
    if not allow and not is_loopback(host):
        raise ValueError(
            f"host {host} can be reached from the network: add the clients that may connect, "
            'allow = ["192.168.1.0/24"] (all: ["0.0.0.0/0", "::/0"])'
        )
    return allow


def check_plain_http(allowed: bool, section: ValidationInfo) -> bool:
    """Return `allowed`. Raises ValueError if it is False and the page has no encryption on a network."""
    host = section.data.get("host", "localhost")
    if not (allowed or section.data.get("certificate", "invalid") or is_loopback(host)):
        raise ValueError(
            f"host {host} can be reached from the network, and the page has no certificate: add certificate "
            "and key (pneuforce certificates instrument makes them), or add allow_plain_http = true"
        )
    return allowed


def check_roles(roles: dict[str, list[str]]) -> dict[str, list[str]]:
    """Return `roles`. Raises ValueError if a role has an unknown right."""
    for role, rights in roles.items():
        for right in rights:
            if right not in RIGHTS:
                raise ValueError(f"{right} of the role {role} is not a right: known are {', '.join(RIGHTS)}")
    return roles


def is_loopback(host: str) -> bool:
    """Return True if a host name or an address is that of this machine."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
