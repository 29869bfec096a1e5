"""Checks of a configuration that need no port: whether the servers of the instrument can be created."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

from pneuforce.errors import ConfigurationError, ConfigurationFileError, PneuforceError
from pneuforce.instrument.config import Configuration, load_with_problem, resolve_path
from pneuforce.instrument.service.buses.can_server import options_of
from pneuforce.instrument.service.buses.rtu_server import check_ports
from pneuforce.instrument.service.checks.certificate_checks import certificate_problems
from pneuforce.instrument.service.checks.collisions import collisions
from pneuforce.instrument.service.processes.modbus_security_server import gateway_socket, required
from pneuforce.instrument.service.processes.mqtt_process import (
    mqtt_file_problems,
    mqtt_files,
    mqtt_process_of,
    mqtt_setting_problems,
)
from pneuforce.instrument.service.processes.web_process import web_process_of
from pneuforce.instrument.signing.trusted_keys import trusted_keys_of

MAX_SOCKET_PATH_BYTES = 107  #: longest path of a Unix socket (sun_path in sys/un.h, without the final zero)


def load_checked(path: Path, require_signed_by: Path | None = None) -> Configuration:
    """Return the configuration of a TOML file after all checks that need no port.

    Raises ConfigurationFileError with file, keys and remedies.
    """
    configuration, problem = load_trusted(path, require_signed_by)
    reject(path, (problem, *start_problems(configuration, path)))
    return configuration


def load_trusted(path: Path, require_signed_by: Path | None = None) -> tuple[Configuration, str]:
    """Return the configuration of a TOML file, and why its calibration cannot be used; "" if it can.

    If `require_signed_by` is a file of trusted keys, only files that are signed with these keys are accepted.
    Raises ConfigurationFileError with file, key and remedy.
    """
    try:
        trusted = trusted_keys_of(path, require_signed_by)
    except ConfigurationError as error:
        raise ConfigurationFileError(str(error)) from None
    return load_with_problem(path, trusted)


def reject(path: Path, problems: Iterable[str]) -> None:
    """Raise ConfigurationFileError with one line for each problem of a configuration file.

    Do nothing if there is no problem. An empty text is no problem.
    """
    if lines := [f"{path}: {problem}" for problem in dict.fromkeys(problems) if problem]:
        raise ConfigurationFileError("\n".join(lines))


def start_problems(configuration: Configuration, path: Path) -> Iterator[str]:
    """Yield a clause for each reason for which the instrument cannot start."""
    socket = resolve_path(path, configuration.local.socket)
    checks: tuple[Callable[[], object], ...] = (
        partial(_check_can, configuration),
        partial(check_ports, configuration),
        partial(check_socket_path, socket),
        partial(web_process_of, configuration.web, socket),
        partial(_check_gateway_socket, configuration, socket),
        partial(mqtt_process_of, configuration, socket, mqtt_files(configuration.mqtt, path)),
    )
    for check in checks:
        try:
            check()
        except PneuforceError as error:
            yield str(error)
    yield from collisions(configuration, path)
    yield from certificate_problems(configuration, path)
    yield from mqtt_setting_problems(configuration.mqtt)
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
