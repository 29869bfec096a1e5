"""Checks of a configuration that need no port: whether the servers of the instrument can be created."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

from pneuforce.errors import ConfigurationError, ConfigurationFileError, PneuforceError
from pneuforce.instrument.config import Configuration, load, resolve_path
from pneuforce.instrument.service.buses.can_server import options_of
from pneuforce.instrument.service.buses.rtu_server import check_ports
from pneuforce.instrument.service.checks.certificate_checks import certificate_problems
from pneuforce.instrument.service.checks.collisions import check_collisions
from pneuforce.instrument.service.processes.modbus_security_server import gateway_socket, required
from pneuforce.instrument.service.processes.mqtt_process import check_mqtt, mqtt_file_problems
from pneuforce.instrument.service.processes.web_process import web_process_of
from pneuforce.instrument.signing.trusted_keys import trusted_keys_of

MAX_SOCKET_PATH_BYTES = 107  #: longest path of a Unix socket (sun_path in sys/un.h, without the final zero)


def load_checked(path: Path, require_signed_by: Path | None = None) -> Configuration:
    """Return the configuration of a TOML file after all checks that need no port.

    Raises ConfigurationFileError with file, keys and remedies.
    """
    configuration = load_trusted(path, require_signed_by)
    reject(path, start_problems(configuration, path))
    return configuration


def load_trusted(path: Path, require_signed_by: Path | None = None) -> Configuration:
    """Return the configuration of a TOML file.

    If `require_signed_by` is a file of trusted keys, only files that are signed with these keys are accepted.
    Raises ConfigurationFileError with file, key and remedy.
    """
    try:
        trusted = trusted_keys_of(path, require_signed_by)
    except ConfigurationError as error:
        raise ConfigurationFileError(str(error)) from None
    return load(path, trusted)


def reject(path: Path, problems: Iterable[str]) -> None:
    """Raise ConfigurationFileError with all problems of a configuration file, if there are any."""
    if text := "; ".join(dict.fromkeys(problems)):
        raise ConfigurationFileError(f"{path}: {text}")


def start_problems(configuration: Configuration, path: Path) -> Iterator[str]:
    """Yield a clause for each reason for which the instrument cannot start."""
    socket = resolve_path(path, configuration.local.socket)
    checks: tuple[Callable[[], object], ...] = (
        partial(_check_can, configuration),
        partial(check_ports, configuration),
        partial(check_collisions, configuration, path),
        partial(check_socket_path, socket),
        partial(web_process_of, configuration.web, socket),
        partial(_check_gateway_socket, configuration, socket),
        partial(check_mqtt, configuration, path, socket),
    )
    for check in checks:
        try:
            check()
        except PneuforceError as error:
            yield str(error)
    yield from certificate_problems(configuration, path)
    yield from mqtt_file_problems(configuration.mqtt, path)


def _check_can(configuration: Configuration) -> None:
    if configuration.can.enabled:
        options_of(configuration.can)


def _check_gateway_socket(configuration: Configuration, socket: Path | None) -> None:
    if configuration.modbus_security.enabled:
        check_socket_path(gateway_socket(required(socket)))


def check_socket_path(socket: Path | None) -> None:
    """Raise ConfigurationError if the path of the local socket is too long for the operating system."""
    if socket is not None and len(os.fsencode(socket)) > MAX_SOCKET_PATH_BYTES:
        raise ConfigurationError(
            f"local.socket: the path {socket} is longer than {MAX_SOCKET_PATH_BYTES} bytes: "
            "choose a shorter path, for example in /run"
        )
