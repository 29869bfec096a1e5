"""Process of MQTT with Sparkplug B, and the checks of its settings."""

from __future__ import annotations

import logging
import re
import socket
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from pneuforce.errors import ServerError
from pneuforce.instrument.config import Configuration, MqttSection, resolve_path
from pneuforce.instrument.service.processes.tls_process import TlsProcess
from pneuforce.support.broker_url import broker_address
from pneuforce.support.client_tls import client_context
from pneuforce.support.permissions import read_problem

END_S = 1.0  #: time to publish the death and to store what the broker has not confirmed
LIBRARIES = ("aiomqtt", "google.protobuf")  #: the extra `mqtt` installs them

_READ_FILES = ("ca", "certificate", "key", "password_file")
_FILES = (*_READ_FILES, "store")
_SETTINGS = (
    *("group", "device", "period_s", "force_deadband_n", "pressure_deadband_kpa", "primary_host", "user"),
    *("store_max_mb", "store_max_age_h"),
)


class MqttProcess(TlsProcess):
    """MQTT process of a configuration, on the local socket of the host."""

    connected = False  #: True while the broker is connected
    stored = 0  #: records that wait for the broker
    lost = 0  #: records that were never sent, since the start of the process

    def __init__(self, configuration: Configuration, socket: Path, files: Mapping[str, str]) -> None:
        settings = configuration.mqtt
        options = {
            "socket": str(socket),
            **broker_address(settings.broker)._asdict(),
            "edge_node": edge_node_of(configuration),
            **settings.model_dump(include=set(_SETTINGS)),
            **files,
        }
        super().__init__("pneuforce.mqtt", "MQTT", options)
        self._line = f"MQTT to {settings.broker} as {settings.group}/{options['edge_node']}/{settings.device}"

    def serving_line(self) -> str:
        """Return the line of the log when the process has started."""
        return self._line

    def on_heartbeat(self, message: Mapping[str, Any]) -> None:
        """Keep the state of the connection. Raises KeyError, TypeError or ValueError if it is invalid."""
        super().on_heartbeat(message)
        was_connected, self.connected = self.connected, bool(message["connected"])
        if self.connected and not was_connected:
            self.log(logging.INFO, f"{self._service}: the broker is connected")
        self.stored, self.lost = int(message["stored"]), int(message["lost"])

    def on_end(self) -> None:
        """Mark the broker as not connected."""
        self.connected = False

    @property
    def end_s(self) -> float:
        """Return the time after which the process is killed if it does not end by itself [s]."""
        return END_S


def edge_node_of(configuration: Configuration) -> str:
    """Return the name of the edge node: the configured one, or one with the serial or the host name."""
    number = configuration.identity.serial_number
    name = str(number) if number else re.sub(r"[^\w.-]", "-", socket.gethostname())
    return configuration.mqtt.edge_node or f"pneuforce-{name}"


def mqtt_files(settings: MqttSection, configuration_file: Path) -> dict[str, str]:
    """Return the paths of the files of MQTT. The path of an unused file is empty."""
    paths = {name: resolve_path(configuration_file, getattr(settings, name)) for name in _FILES}
    return {name: str(path.absolute()) if path else "" for name, path in paths.items()}


def mqtt_process_of(
    configuration: Configuration, socket: Path | None, files: Mapping[str, str]
) -> MqttProcess | None:
    """Return the MQTT process of a configuration, or None if it is disabled or no files are given.

    Raises ServerError if there is no local socket, or a library is missing.
    """
    if not configuration.mqtt.enabled or not files:
        return None
    if socket is None:
        raise ServerError("mqtt.enabled = true needs the local socket, but local.socket is empty: set it")
    if not all(map(_is_installed, LIBRARIES)):
        raise ServerError(
            "mqtt.enabled = true needs libraries that are not installed: pip install 'pneuforce[mqtt]'"
        )
    return MqttProcess(configuration, socket, files)


def health(process: MqttProcess | None) -> dict[str, Any] | None:
    """Return the state of the connection and the counters, or None if MQTT is disabled."""
    if process is None:
        return None
    names = ("certificate_days", "connected", "stored", "lost")
    return {name: getattr(process, name) for name in names}


def mqtt_setting_problems(settings: MqttSection) -> Iterator[str]:
    """Yield a clause for each setting of MQTT that does not fit the others."""
    if not settings.enabled:
        return
    if bool(settings.certificate) != bool(settings.key):
        yield "mqtt: set both certificate and key, or none of them"
    if settings.password_file and not settings.user:
        yield "mqtt: password_file needs user: set it"
    if not broker_address(settings.broker).tls and (settings.ca or settings.certificate):
        yield "mqtt: ca and certificate need TLS: set broker to mqtts://…"


def mqtt_file_problems(settings: MqttSection, path: Path) -> Iterator[str]:
    """Yield a clause for each file of MQTT that cannot be used. `path` is the configuration file."""
    if not settings.enabled:
        return
    files = mqtt_files(settings, path)
    problems = {name: read_problem(Path(files[name])) for name in _READ_FILES if files[name]}
    yield from (f"mqtt.{name}: {problem}" for name, problem in problems.items() if problem)
    try:
        is_complete = bool(settings.certificate) == bool(settings.key)
        if is_complete and not any(problems.values()) and broker_address(settings.broker).tls:
            client_context(files["ca"], files["certificate"], files["key"])
    except OSError as error:
        yield f"mqtt: {error}"


def _is_installed(library: str) -> bool:
    try:
        return find_spec(library) is not None
    except ModuleNotFoundError:
        return False
