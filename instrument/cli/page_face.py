"""The page as a process of its own: begun with the host, begun again when it fails, ended with the host."""

from __future__ import annotations

import asyncio
import json
import logging
import sys
from asyncio.subprocess import PIPE, Process
from contextlib import suppress
from pathlib import Path
from typing import Any

from instrument.config import Page
from instrument.errors import FaceError

log = logging.getLogger("pneuforce")

READY_S = 20.0
BACK_OFF_S = (1.0, 60.0)
END_S = 0.25  #: for it to end by itself; it keeps nothing


class PageFace:
    """The page of a configuration, on the host's local socket."""

    def __init__(self, own: Page, socket: Path) -> None:
        self._told = {
            "socket": str(socket),
            "host": own.host,
            "port": own.port,
            "allow": own.allow,
            "token": own.token.get_secret_value(),
        }
        self._process: Process | None = None
        self._said = ""  # its last words
        self._complaint = ""
        self._hearing: asyncio.Task[None] | None = None
        self._keeping: asyncio.Task[None] | None = None

    async def begin(self) -> None:
        """Start the process. Raises OSError."""
        self._said = ""
        self._process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "page"),
            stdin=PIPE,
            stdout=PIPE,
            stderr=PIPE,
            start_new_session=True,  # Ctrl-C is for the instrument, which ends it
        )
        self._hearing = asyncio.create_task(self._hear(self._process))
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(self._told).encode() + b"\n")

    async def ready(self) -> int:
        """Its port, as soon as it serves; from then on it is kept alive. Raises FaceError: it cannot."""
        port = await self._answer()
        log.info("the page is at http://%s:%d/", self._told["host"], port)
        self._keeping = asyncio.create_task(self._keep())
        return port

    async def _answer(self) -> int:
        assert self._process is not None
        assert self._process.stdout is not None
        try:
            line = await asyncio.wait_for(self._process.stdout.readline(), READY_S)
        except TimeoutError:
            self._process.kill()
            raise FaceError(f"the page does not get ready within {READY_S:g} s") from None
        answer: dict[str, Any] = (
            json.loads(line) if line else {"why": f"the page ended at once: {await self._end()}"}
        )
        if "why" in answer:
            raise FaceError(str(answer["why"]))
        return int(answer["page"])

    async def _hear(self, process: Process) -> None:
        """Put what it says into the log of the host."""
        assert process.stderr is not None
        with suppress(ValueError):  # a line without end: nothing of ours
            while line := await process.stderr.readline():
                self._said = line.decode(errors="replace").rstrip()
                log.warning("%s", self._said)

    async def _end(self) -> str:
        """Why it ended, when it has."""
        assert self._process is not None
        assert self._hearing is not None
        code = await self._process.wait()
        await self._hearing
        return self._said or f"exit code {code}"

    async def _keep(self) -> None:
        """Begin it again whenever it ends, later and later while that does not help."""
        loop, back_off_s = asyncio.get_running_loop(), BACK_OFF_S[0]
        while True:
            begun_s = loop.time()
            self._complain(f"the page ended, and is begun again: {await self._end()}")
            if loop.time() - begun_s > BACK_OFF_S[1]:
                back_off_s = BACK_OFF_S[0]
            await asyncio.sleep(back_off_s)
            back_off_s = min(2 * back_off_s, BACK_OFF_S[1])
            try:
                await self.begin()
                await self._answer()
            except OSError as error:
                self._complain(f"the page cannot be begun again: {error}")

    def _complain(self, why: str) -> None:
        if why != self._complaint:
            self._complaint = why
            log.warning("%s", why)

    async def close(self) -> None:
        """End it."""
        if self._keeping is not None:
            self._keeping.cancel()
        if self._process is None or self._process.returncode is not None:
            return
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            await asyncio.wait_for(self._process.wait(), END_S)
        except TimeoutError:
            with suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()


def page_face(own: Page, socket: Path | None) -> PageFace | None:
    """The page of a configuration, None where it is off. Raises FaceError: it has no socket to listen to."""
    if not own.enabled:
        return None
    if socket is None:
        raise FaceError("page.enabled: the page listens on local.socket, and that is empty: name one")
    return PageFace(own, socket)
