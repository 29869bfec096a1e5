"""Checks of a configuration that need no port: whether the servers of the instrument can be created."""

from __future__ import annotations

import os
from pathlib import Path

from pneuforce.errors import ConfigurationError, ConfigurationFileError, PneuforceError
from pneuforce.instrument.config import Configuration, load, resolve_path
from pneuforce.instrument.service.buses.can_server import options_of
from pneuforce.instrument.service.buses.rtu_server import check_ports
from pneuforce.instrument.service.checks.certificate_checks import check_certificates
from pneuforce.instrument.service.checks.collisions import check_collisions
from pneuforce.instrument.service.processes.modbus_security_server import gateway_socket, required
from pneuforce.instrument.service.processes.mqtt_process import check_mqtt
from pneuforce.instrument.service.processes.web_process import web_process_of
from pneuforce.instrument.signing.trusted_keys import trusted_keys_of

MAX_SOCKET_PATH_BYTES = 107  #: longest path of a Unix socket (sun_path in sys/un.h, without the final zero)


def load_checked(path: Path, require_signed_by: Path | None = None) -> Configuration:
    """Return the configuration of a TOML file after all checks that need no port.

    If `require_signed_by` is a file of trusted keys, only files that are signed with these keys are accepted.
    Raises ConfigurationFileError with file, key and remedy.
    """
    try:
        trusted = trusted_keys_of(path, require_signed_by)
    except ConfigurationError as error:
        raise ConfigurationFileError(str(error)) from None
    configuration = load(path, trusted)
    try:
        if configuration.can.enabled:
            options_of(configuration.can)
        check_ports(configuration)
        check_collisions(configuration, path)
        socket = resolve_path(path, configuration.local.socket)
        check_socket_path(socket)
        web_process_of(configuration.web, socket)
        if configuration.modbus_security.enabled:
            check_socket_path(gateway_socket(required(socket)))
        check_certificates(configuration, path)
        check_mqtt(configuration, path, socket)
    except PneuforceError as error:
        raise ConfigurationFileError(f"{path}: {error}") from None
    return configuration


def check_socket_path(socket: Path | None) -> None:
    """Raise ConfigurationError if the path of the local socket is too long for the operating system."""
    if socket is not None and len(os.fsencode(socket)) > MAX_SOCKET_PATH_BYTES:
        raise ConfigurationError(
            f"local.socket: the path {socket} is longer than {MAX_SOCKET_PATH_BYTES} bytes: "
            "choose a shorter path, for example in /run"
        )
