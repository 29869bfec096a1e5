"""Check that several instruments on one computer use different ports, files, CAN nodes and boards."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from itertools import combinations
from pathlib import Path
from typing import NamedTuple, TypeVar

from pneuforce.errors import ConfigurationFileError
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.checks.collisions import collision, is_same_written_file, listening_ports
from pneuforce.instrument.service.checks.configured_files import configured_files
from pneuforce.instrument.service.processes.mqtt_process import edge_node_of
from pneuforce.support.network_name import is_socket_url

First = TypeVar("First")
Second = TypeVar("Second")


class Resource(NamedTuple):
    """Something that only one instrument may use. `key` is the configuration key."""

    key: str
    identity: tuple[object, ...]
    name: str


def check_instruments(configurations: Mapping[Path, Configuration]) -> None:
    """Raise ConfigurationFileError if two instruments use the same port, file, CAN node or board.

    The message has one line for each collision.
    """
    if collisions := list(_collisions(configurations)):
        raise ConfigurationFileError("\n".join(collisions))


def _collisions(configurations: Mapping[Path, Configuration]) -> Iterator[str]:
    for (path, configuration), (other_path, other) in combinations(configurations.items(), 2):
        for port, other_port in _pairs(listening_ports(configuration), listening_ports(other)):
            if port.collides_with(other_port):
                what = f"the TCP port {port.port}"
                yield collision(f"{path}: {port.key}", f"{other_path}: {other_port.key}", what)
        for resource, other_resource in _pairs(_resources(configuration), _resources(other)):
            if resource.identity == other_resource.identity:
                keys = f"{path}: {resource.key}", f"{other_path}: {other_resource.key}"
                yield collision(*keys, resource.name)
        for file, other_file in _pairs(
            configured_files(configuration, path), configured_files(other, other_path)
        ):
            if is_same_written_file(file, other_file):
                keys = f"{path}: {file.key}", f"{other_path}: {other_file.key}"
                yield collision(*keys, os.path.realpath(file.path))


def _pairs(first: Iterator[First], second: Iterator[Second]) -> Iterator[tuple[First, Second]]:
    others = list(second)
    return ((each, other) for each in first for other in others)


def _resources(configuration: Configuration) -> Iterator[Resource]:
    rig, rtu, rdt = configuration.rig, configuration.modbus_rtu, configuration.rdt
    yield Resource("rig.port", *_serial_port(rig.port))
    if rtu.enabled:
        yield Resource("modbus_rtu.port", *_serial_port(rtu.port))
    if rdt.enabled:
        yield Resource("rdt", ("udp", rdt.host, rdt.port), f"the UDP port {rdt.port} of {rdt.host}")
    mqtt = configuration.mqtt
    if mqtt.enabled:
        edge_node = edge_node_of(configuration)
        identity = ("mqtt", mqtt.broker, mqtt.group, edge_node)
        yield Resource("mqtt.edge_node", identity, f"the edge node {mqtt.group}/{edge_node}")
    yield from _can_node(configuration)
    serial_number = configuration.identity.serial_number
    if serial_number:
        yield Resource("identity.serial_number", ("serial", serial_number), str(serial_number))


def _serial_port(port: str) -> tuple[tuple[object, ...], str]:
    real = port if is_socket_url(port) else os.path.realpath(port)
    return ("port", real), real


def _can_node(configuration: Configuration) -> Iterator[Resource]:
    can = configuration.can
    if can.enabled:
        server = (can.host, can.port) if can.interface == "socketcand" else ()
        identity = ("can", can.interface, can.channel, *server, can.node_id)
        yield Resource("can.node_id", identity, f"node {can.node_id} on {can.interface} {can.channel}")
