"""The recorder of `run --record`: a process of its own, which the instrument starts and watches."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from instrument.cli.local_face import LocalFace
from instrument.errors import FaceError

READY_S = 15.0
LOOK_S = 0.02
END_S = 3.0


class Recorder:
    """`pneuforce record` on the local socket, from before the first byte of the rig on."""

    def __init__(self, local: LocalFace, socket: Path, file: Path) -> None:
        self._local = local
        self._arguments = ["-P", "-m", "instrument", "record", str(file), "--socket", str(socket)]
        self._process: asyncio.subprocess.Process | None = None
        self._watching: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Start it, and wait until it listens. Raises FaceError: it ended, in its own last words."""
        self._process = await asyncio.create_subprocess_exec(
            sys.executable,
            *self._arguments,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for the instrument, which tells it when all is told
        )
        until_s = asyncio.get_running_loop().time() + READY_S
        while not self._local.recording and self._process.returncode is None:
            if asyncio.get_running_loop().time() > until_s:
                break
            await asyncio.sleep(LOOK_S)
        if not self._local.recording:
            if self._process.returncode is None:
                self._process.terminate()
            raise FaceError(f"the recording does not begin: {await _last_words(self._process)}")
        self._watching = asyncio.create_task(self._watch())

    async def _watch(self) -> None:
        assert self._process is not None
        self._local.troubled(await _last_words(self._process))

    async def ended(self) -> None:
        """Wait until it has written what it was told, after the local face has closed."""
        if self._watching is None or self._process is None:
            return
        self._watching.cancel()
        try:
            await asyncio.wait_for(self._process.wait(), END_S)
        except TimeoutError:
            self._process.kill()  # it may be stopped, and hear of nothing else


async def _last_words(process: asyncio.subprocess.Process) -> str:
    """What a process said last, once it has ended."""
    _, said = await process.communicate()
    lines = said.decode(errors="replace").strip().splitlines()
    return lines[-1].removeprefix("pneuforce: ") if lines else "its process has ended"
