"""Process of the web page: started with the host, restarted after a failure, ended with the host."""

from __future__ import annotations

import asyncio
import json
import logging
import sys
from asyncio import StreamReader
from asyncio.subprocess import PIPE, Process
from collections import deque
from collections.abc import Awaitable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from pneuforce.errors import ServerError
from pneuforce.instrument.config import WebSection
from pneuforce.instrument.service.web_libraries import installed_versions, untested
from pneuforce.support.backoff import Backoff

log = logging.getLogger("pneuforce")

Result = TypeVar("Result")

START_TIMEOUT_S = 20.0
SILENCE_S = 10.0  #: longest time without a heartbeat; the process sends a heartbeat each second
PORT_TIMEOUT_S = 3.0  #: longest time for which the start of the instrument waits for the web page
FIRST_WAIT_S = 1.0
MAX_WAIT_S = STABLE_S = 60.0
MAX_LOGGED = 50  #: number of latest logged lines; a line that equals one of these is not logged
END_S = 0.25  #: time after which a process that does not end by itself is killed
RECORDING_END_S = 4.0  #: the same time if the process ends a recording


class WebProcess:
    """Web page of a configuration, on the local socket of the host.

    A running instrument never waits for this process, and a failure of the process does not affect the
    instrument. Each failure is logged once. After a failure the process is restarted, with growing delays.
    """

    def __init__(
        self,
        settings: WebSection,
        socket: Path,
        recordings: Path | None = None,
        silence_s: float = SILENCE_S,
    ) -> None:
        self.port: int | None = None  #: port of the web page, None while it is not served
        self._options = {
            "socket": str(socket),
            "host": settings.host,
            "port": settings.port,
            "allow": settings.allow,
            "token": settings.token.get_secret_value(),
            "recordings": str(recordings.absolute()) if recordings else "",
            "recording_max_mb": settings.recording_max_mb,
            "recording_min_free_mb": settings.recording_min_free_mb,
        }
        self._is_recording = False
        self._silence_s = silence_s
        self._logged: deque[str] = deque(maxlen=MAX_LOGGED)
        self._last_message = ""
        self._attempted = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Start the process, and restart it whenever it ends. Log a warning for each untested library."""
        for sentence in untested(installed_versions()):
            self._log(logging.WARNING, sentence)
        self._task = asyncio.create_task(self._keep_running())

    async def first_port(self) -> int | None:
        """Return the port as soon as the page is served, or None if the first start fails or is slow."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._attempted.wait(), PORT_TIMEOUT_S)
        return self.port

    async def close(self) -> None:
        """End the process."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _keep_running(self) -> None:
        loop, backoff = asyncio.get_running_loop(), Backoff(FIRST_WAIT_S, MAX_WAIT_S, STABLE_S)
        while True:
            backoff.opened(loop.time())
            self._log(
                logging.WARNING, f"the web page is missing: {await self._run()}; the web process is restarted"
            )
            self._attempted.set()
            if backoff.failed(loop.time()):
                self._logged.clear()
            await asyncio.sleep(backoff.wait_s)
            backoff.attempted()

    async def _run(self) -> str:
        """Run the process until it ends or hangs; return the reason."""
        try:
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-P", "-m", "pneuforce.web"),
                stdin=PIPE,
                stdout=PIPE,
                stderr=PIPE,
                start_new_session=True,  # Ctrl-C must reach only the instrument, which then ends this process
            )
        except OSError as error:
            return f"the web process cannot be started: {error.strerror or error}"
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        logging_stderr = asyncio.create_task(self._log_stderr(process.stderr))
        try:
            process.stdin.write(json.dumps(self._options).encode() + b"\n")
            why = await self._monitor(process.stdout)
        finally:
            self.port = None
            await _end(process, RECORDING_END_S if self._is_recording else END_S)
            self._is_recording = False
            await logging_stderr
        return why or f"the web process ended: {self._last_message or f'exit code {process.returncode}'}"

    async def _monitor(self, stdout: StreamReader) -> str:
        """Read the messages of the process until it ends. Return an error, or an empty string."""
        timeout_s = START_TIMEOUT_S
        try:
            while line := await _within(timeout_s, stdout.readline()):
                message: dict[str, Any] = json.loads(line)
                if "why" in message:
                    return str(message["why"])
                if "web" in message:
                    self._serving(int(message["web"]))
                self._is_recording = bool(message.get("recording"))
                timeout_s = self._silence_s
        except TimeoutError:
            return f"the web process sent nothing for {timeout_s:g} s and was ended"
        except (TypeError, ValueError):
            return "the web process sent an invalid message"
        return ""

    def _serving(self, port: int) -> None:
        self.port = port
        self._log(logging.INFO, f"the web page is at http://{self._options['host']}:{port}/")
        self._attempted.set()

    async def _log_stderr(self, stderr: StreamReader) -> None:
        """Copy the messages of the process into the log of the host."""
        with suppress(ValueError):  # readline raises ValueError for a line that is too long
            while line := await stderr.readline():
                self._last_message = line.decode(errors="replace").rstrip()
                self._log(logging.WARNING, self._last_message)

    def _log(self, level: int, line: str) -> None:
        if line not in self._logged:
            self._logged.append(line)
            log.log(level, "%s", line)


async def _within(time_s: float, work: Awaitable[Result]) -> Result:
    """Return the result of `work`. Raises TimeoutError after `time_s`.

    Unlike `asyncio.wait_for` in Python 3.11, this function never loses a cancellation.
    """
    async with asyncio.timeout(time_s):
        return await work


async def _end(process: Process, timeout_s: float) -> None:
    """End the process, even if it hangs."""
    assert process.stdin is not None
    process.stdin.close()
    with suppress(TimeoutError, ProcessLookupError):
        try:
            await _within(timeout_s, process.wait())
        finally:  # runs also if the host cancels this task
            if process.returncode is None:
                process.kill()
    await process.wait()


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
