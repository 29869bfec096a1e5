"""Process of the web page."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pneuforce.errors import ServerError
from pneuforce.instrument.config import WebSection, absolute_paths
from pneuforce.instrument.service.processes.service_process import END_S, SILENCE_S
from pneuforce.instrument.service.processes.tls_process import TlsProcess
from pneuforce.instrument.service.processes.web_libraries import installed_versions, untested
from pneuforce.support.network_name import WILDCARDS

RECORDING_END_S = 4.0  #: time for the end of the process if it ends a recording


def web_tls_files(settings: WebSection, configuration_file: Path) -> dict[str, str]:
    """Return the absolute paths of certificate and key; "" without a certificate."""
    return absolute_paths(configuration_file, settings, ("certificate", "key"))


def web_files(settings: WebSection, configuration_file: Path) -> dict[str, str]:
    """Return the absolute paths of certificate, key, users and folder of recordings; "" if not used."""
    others = absolute_paths(configuration_file, settings, ("recordings", "users_file"))
    return web_tls_files(settings, configuration_file) | others


class WebProcess(TlsProcess):
    """Web page of a configuration, on the local socket of the host."""

    def __init__(
        self,
        settings: WebSection,
        socket: Path,
        files: Mapping[str, str] = MappingProxyType({}),
        silence_s: float = SILENCE_S,
    ) -> None:
        """Create the process without starting it.

        `files` contains paths as `web_files` returns them, and `events`: the event log.
        """
        options = {
            "socket": str(socket),
            "host": settings.host,
            "port": settings.port,
            "allow": settings.allow,
            "certificate": settings.certificate,
            "key": settings.key,
            "session_idle_timeout_s": settings.session_idle_timeout_s,
            "session_timeout_s": settings.session_timeout_s,
            "recording_max_mb": settings.recording_max_mb,
            "recording_min_free_mb": settings.recording_min_free_mb,
            **files,
        }
        super().__init__("pneuforce.web", "the web page", options, silence_s)
        self._is_recording = False

    def begin(self) -> None:
        """Start the process, and restart it whenever it ends. Log a warning for each untested library."""
        for sentence in untested(installed_versions()):
            self.log(logging.WARNING, sentence)
        super().begin()

    def serving_line(self) -> str:
        """Return the line of the log when the page is served."""
        scheme, host = "https" if self._options["certificate"] else "http", self._options["host"]
        if host in WILDCARDS:  # a browser cannot open this address
            return f"the web page is on port {self.port} of every address of this computer ({scheme})"
        return f"the web page is at {scheme}://{f'[{host}]' if ':' in host else host}:{self.port}/"

    def on_heartbeat(self, message: Mapping[str, Any]) -> None:
        """Remember whether the page records, and when its certificate expires."""
        super().on_heartbeat(message)
        self._is_recording = bool(message.get("recording"))

    def on_end(self) -> None:
        """Forget the recording."""
        self._is_recording = False

    @property
    def end_s(self) -> float:
        """Return the time after which the process is killed if it does not end by itself [s]."""
        return RECORDING_END_S if self._is_recording else END_S


def web_process_of(
    settings: WebSection, socket: Path | None, files: Mapping[str, str] = MappingProxyType({})
) -> WebProcess | None:
    """Return the web process of a configuration, or None if it is disabled.

    Raises ServerError if there is no local socket.
    """
    if not settings.enabled:
        return None
    if socket is None:
        raise ServerError("web.enabled = true needs the local socket, but local.socket is empty: set it")
    return WebProcess(settings, socket, files)
