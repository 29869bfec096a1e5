"""The page as a process of its own: begun with the host, begun again when it fails, ended with the host."""

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

from instrument.config import Page
from instrument.errors import FaceError
from registers.back_off import BackOff

log = logging.getLogger("pneuforce")

Result = TypeVar("Result")

READY_S = 20.0
SILENCE_S = 10.0  #: it says each second that it goes round
PATIENCE_S = 3.0  #: of whoever wants to say where it is
AGAIN_S = 1.0
LONGEST_S = WELL_S = 60.0
MOST_SAID = 50  #: lines that are not told again
END_S = 0.25  #: for it to end by itself; it keeps nothing


class PageFace:
    """The page of a configuration, on the host's local socket.

    Nothing waits for it, and none of its troubles reaches the instrument: each is told once, and it is begun
    again, later and later while that does not help.
    """

    def __init__(self, own: Page, socket: Path, silence_s: float = SILENCE_S) -> None:
        self.port: int | None = None  #: where it serves now; None where it does not
        self._told = {
            "socket": str(socket),
            "host": own.host,
            "port": own.port,
            "allow": own.allow,
            "token": own.token.get_secret_value(),
        }
        self._silence_s = silence_s
        self._said: deque[str] = deque(maxlen=MOST_SAID)
        self._last_words = ""
        self._tried = asyncio.Event()
        self._keeping: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Begin it, and keep it alive from now on."""
        self._keeping = asyncio.create_task(self._keep())

    async def tried(self) -> int | None:
        """Its port, as soon as it serves; None where it fails at first, or takes its time."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._tried.wait(), PATIENCE_S)
        return self.port

    async def close(self) -> None:
        """End it."""
        if self._keeping is not None:
            self._keeping.cancel()
            await asyncio.wait([self._keeping])

    async def _keep(self) -> None:
        loop, back_off = asyncio.get_running_loop(), BackOff(AGAIN_S, LONGEST_S, WELL_S)
        while True:
            back_off.opened(loop.time())
            self._say(logging.WARNING, f"{await self._live()}; it is tried again")
            self._tried.set()
            if back_off.failed(loop.time()):
                self._said.clear()
            await asyncio.sleep(back_off.wait_s)
            back_off.tried()

    async def _live(self) -> str:
        """Have it serve for as long as it does; why it does no longer."""
        self._last_words = ""
        try:
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-P", "-m", "page"),
                stdin=PIPE,
                stdout=PIPE,
                stderr=PIPE,
                start_new_session=True,  # Ctrl-C is for the instrument, which ends it
            )
        except OSError as error:
            return f"the page cannot be begun: {error.strerror or error}"
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        quoting = asyncio.create_task(self._quote(process.stderr))
        try:
            process.stdin.write(json.dumps(self._told).encode() + b"\n")
            why = await self._hear(process.stdout)
        finally:
            self.port = None
            await _end(process)
            await quoting
        return why or f"the page ended: {self._last_words or f'exit code {process.returncode}'}"

    async def _hear(self, stdout: StreamReader) -> str:
        """Why it is to be ended; empty where it has ended by itself."""
        wait_s = READY_S
        try:
            while line := await _within(wait_s, stdout.readline()):
                told: dict[str, Any] = json.loads(line)
                if "why" in told:
                    return str(told["why"])
                if "page" in told:
                    self._serves(int(told["page"]))
                wait_s = self._silence_s
        except TimeoutError:
            return f"the page said nothing for {wait_s:g} s, so it was ended"
        except (TypeError, ValueError):
            return "the page says what no page says"
        return ""

    def _serves(self, port: int) -> None:
        self.port = port
        self._say(logging.INFO, f"the page is at http://{self._told['host']}:{port}/")
        self._tried.set()

    async def _quote(self, stderr: StreamReader) -> None:
        """Put what it complains of into the log of the host."""
        with suppress(ValueError):  # a line without end: nothing of ours
            while line := await stderr.readline():
                self._last_words = line.decode(errors="replace").rstrip()
                self._say(logging.WARNING, self._last_words)

    def _say(self, level: int, what: str) -> None:
        if what not in self._said:
            self._said.append(what)
            log.log(level, "%s", what)


async def _within(time_s: float, work: Awaitable[Result]) -> Result:
    """What is waited for. Raises TimeoutError; unlike `asyncio.wait_for` it never swallows a cancellation."""
    async with asyncio.timeout(time_s):
        return await work


async def _end(process: Process) -> None:
    """End it, however it hangs."""
    assert process.stdin is not None
    process.stdin.close()
    with suppress(TimeoutError, ProcessLookupError):
        try:
            await _within(END_S, process.wait())
        finally:  # also where the host ends meanwhile
            if process.returncode is None:
                process.kill()
    await process.wait()


def page_face(own: Page, socket: Path | None) -> PageFace | None:
    """The page of a configuration, None where it is off. Raises FaceError: it has no socket to listen to."""
    if not own.enabled:
        return None
    if socket is None:
        raise FaceError("page.enabled: the page listens on local.socket, and that is empty: name one")
    return PageFace(own, socket)
