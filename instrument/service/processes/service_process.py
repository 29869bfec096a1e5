"""Process that serves clients beside the host: started and ended with the host, restarted after a failure."""

from __future__ import annotations

import asyncio
import json
import logging
import sys
import time
from asyncio import StreamReader
from asyncio.subprocess import PIPE, Process
from collections.abc import Awaitable, Mapping
from contextlib import suppress
from typing import Any, TypeVar

from pneuforce.support.backoff import Backoff
from pneuforce.support.repeated_lines import RepeatedLines

log = logging.getLogger("pneuforce")

Result = TypeVar("Result")

START_TIMEOUT_S = 20.0
SILENCE_PARTS = 4  #: parts of a silence; a stall of the host is one of them
SILENCE_S = 10.0  #: longest time without a heartbeat; the process sends a heartbeat each second
PORT_TIMEOUT_S = 3.0  #: longest time for which the start of the instrument waits for the port
FIRST_WAIT_S = 1.0
MAX_WAIT_S = STABLE_S = 60.0
END_S = 0.25  #: time after which a process that does not end by itself is killed


class ServiceProcess:
    """Python module that runs as a process of its own, until its stdin is closed.

    stdin: one line of JSON with the options. stdout: one line {"port": number} when the process listens, or
    {"port": null, "why": sentence} if it cannot listen. Then one JSON object each second, a heartbeat.

    A running instrument never waits for this process, and a failure of the process does not affect the
    instrument. Each failure is logged once, and then after growing pauses. After a failure the process is
    restarted, with growing delays.
    """

    def __init__(
        self, module: str, service: str, options: Mapping[str, Any], silence_s: float = SILENCE_S
    ) -> None:
        """Create a process of `module` without starting it. `service` is its name in the log."""
        self.port: int | None = None  #: port of the process, None while it does not listen
        self._module, self._service = module, service
        self._options = dict(options)
        self._silence_s = silence_s
        self._logged = RepeatedLines()
        self._last_message = ""
        self._attempted = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    # ---- to be changed by a subclass

    def serving_line(self) -> str:
        """Return the line of the log when the process listens."""
        return f"{self._service} on {self._options['host']}:{self.port}"

    def on_heartbeat(self, message: Mapping[str, Any]) -> None:
        """Handle the content of a heartbeat. Raises TypeError or ValueError if it is invalid."""

    def on_end(self) -> None:
        """Handle the end of the process."""

    @property
    def end_s(self) -> float:
        """Return the time after which the process is killed if it does not end by itself [s]."""
        return END_S

    # ---- as a part of the host

    def begin(self) -> None:
        """Start the process, and restart it whenever it ends."""
        self._task = asyncio.create_task(self._keep_running())

    async def first_port(self) -> int | None:
        """Return the port as soon as the process listens, or None if the first start fails or is slow."""
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
            why = await self._run()
            self.log(logging.WARNING, f"{self._service} is missing: {why}; its process is restarted")
            self._attempted.set()
            if backoff.failed(loop.time()):
                self._logged.clear()
            await asyncio.sleep(backoff.wait_s)
            backoff.attempted()

    async def _run(self) -> str:
        """Run the process until it ends or hangs; return the reason."""
        try:
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-P", "-m", self._module),
                stdin=PIPE,
                stdout=PIPE,
                stderr=PIPE,
                start_new_session=True,  # Ctrl-C must reach only the instrument, which then ends this process
            )
        except OSError as error:
            return f"its process cannot be started: {error.strerror or error}"
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        logging_stderr = asyncio.create_task(self._log_stderr(process.stderr))
        try:
            process.stdin.write(json.dumps(self._options).encode() + b"\n")
            why = await self._monitor(process.stdout)
        finally:
            self.port = None
            await _end(process, self.end_s)
            self.on_end()
            await logging_stderr
        ended = f"exit code {process.returncode}"
        return why or f"its process ended: {(process.returncode == 1 and self._last_message) or ended}"

    async def _monitor(self, stdout: StreamReader) -> str:
        """Read the messages of the process until it ends. Return an error, or an empty string."""
        timeout_s = START_TIMEOUT_S
        try:
            while line := await _read_line(stdout, timeout_s):
                message: dict[str, Any] = json.loads(line)
                if "why" in message:
                    return str(message["why"])
                if "port" in message:
                    self._serving(int(message["port"]))
                else:
                    self.on_heartbeat(message)
                timeout_s = self._silence_s
        except TimeoutError:
            return f"its process sent nothing for {timeout_s:g} s and was ended"
        except (KeyError, TypeError, ValueError):
            return "its process sent an invalid message"
        return ""

    def _serving(self, port: int) -> None:
        self.port = port
        self.log(logging.INFO, self.serving_line())
        self._attempted.set()

    async def _log_stderr(self, stderr: StreamReader) -> None:
        """Copy the messages of the process into the log of the host."""
        with suppress(ValueError):  # readline raises ValueError for a line that is too long
            while line := await stderr.readline():
                self._last_message = line.decode(errors="replace").rstrip()
                self.log(logging.WARNING, self._last_message)

    def log(self, level: int, line: str) -> None:
        """Log a line. An equal line is logged again only after growing pauses."""
        if self._logged.is_due(line, time.monotonic()):
            log.log(level, "%s", line)


async def _within(time_s: float, work: Awaitable[Result]) -> Result:
    """Return the result of `work`. Raises TimeoutError after `time_s`.

    Unlike `asyncio.wait_for` in Python 3.11, this function never loses a cancellation.
    """
    async with asyncio.timeout(time_s):
        return await work


async def _read_line(stdout: StreamReader, time_s: float) -> bytes:
    """Return the next line, b"" at the end. Raises TimeoutError after `time_s`.

    The time has parts, so that a stall of this process, which reads nothing meanwhile, counts as one part.
    """
    for _ in range(SILENCE_PARTS - 1):
        with suppress(TimeoutError):
            return await _within(time_s / SILENCE_PARTS, stdout.readline())
    return await _within(time_s / SILENCE_PARTS, stdout.readline())


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
