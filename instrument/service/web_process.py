"""Process of the web page."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneuforce.errors import ServerError
from pneuforce.instrument.config import WebSection
from pneuforce.instrument.service.service_process import END_S, SILENCE_S, ServiceProcess
from pneuforce.instrument.service.web_libraries import installed_versions, untested

RECORDING_END_S = 4.0  #: time for the end of the process if it ends a recording


class WebProcess(ServiceProcess):
    """Web page of a configuration, on the local socket of the host."""

    def __init__(
        self,
        settings: WebSection,
        socket: Path,
        recordings: Path | None = None,
        silence_s: float = SILENCE_S,
    ) -> None:
        options = {
            "socket": str(socket),
            "host": settings.host,
            "port": settings.port,
            "allow": settings.allow,
            "token": settings.token.get_secret_value(),
            "recordings": str(recordings.absolute()) if recordings else "",
            "recording_max_mb": settings.recording_max_mb,
            "recording_min_free_mb": settings.recording_min_free_mb,
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
        return f"the web page is at http://{self._options['host']}:{self.port}/"

    def on_heartbeat(self, message: Mapping[str, Any]) -> None:
        """Remember whether the page records."""
        self._is_recording = bool(message.get("recording"))

    def on_end(self) -> None:
        """Forget the recording."""
        self._is_recording = False

    @property
    def end_s(self) -> float:
        """Return the time after which the process is killed if it does not end by itself [s]."""
        return RECORDING_END_S if self._is_recording else END_S


def web_process_of(
    settings: WebSection, socket: Path | None, recordings: Path | None = None
) -> WebProcess | None:
    """Return the web process of a configuration, or None if it is disabled.

    `recordings` is the folder of the recordings that operators start on the page; None disables them.

    Raises ServerError if there is no local socket.
    """
    if not settings.enabled:
        return None
    if socket is None:
        raise ServerError("web.enabled = true needs the local socket, but local.socket is empty: set it")
    return WebProcess(settings, socket, recordings)
