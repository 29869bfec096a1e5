"""Recorder of `pneuforce run --record`: a process that the instrument starts and monitors."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from pneuforce.errors import ServerError
from pneuforce.instrument.service.local_socket.server import LocalServer

START_TIMEOUT_S = 15.0
POLL_S = 0.02
END_TIMEOUT_S = 3.0


class RecorderProcess:
    """Process `pneuforce record` on the local socket. It is started before the rig is connected."""

    def __init__(self, local_server: LocalServer, socket: Path, file: Path) -> None:
        self._local_server = local_server
        self._arguments = ["-P", "-m", "pneuforce", "record", str(file), "--socket", str(socket)]
        self._process: asyncio.subprocess.Process | None = None
        self._monitoring: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Start the process and wait until it subscribes.

        Raises ServerError with the last message of the process if it ends or does not subscribe in time.
        """
        self._process = await asyncio.create_subprocess_exec(
            sys.executable,
            *self._arguments,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            start_new_session=True,  # Ctrl-C must reach only the instrument, which then ends the stream
        )
        until_s = asyncio.get_running_loop().time() + START_TIMEOUT_S
        while not self._local_server.recording and self._process.returncode is None:
            if asyncio.get_running_loop().time() > until_s:
                break
            await asyncio.sleep(POLL_S)
        if not self._local_server.recording:
            if self._process.returncode is None:
                self._process.terminate()
            raise ServerError(f"the recording does not start: {await _last_message(self._process)}")
        self._monitoring = asyncio.create_task(self._monitor())

    async def _monitor(self) -> None:
        assert self._process is not None
        self._local_server.recording_failed(await _last_message(self._process))

    async def wait_for_end(self) -> None:
        """Wait until the process has written everything. Call this after the local server has closed."""
        if self._monitoring is None or self._process is None:
            return
        self._monitoring.cancel()
        try:
            await asyncio.wait_for(self._process.wait(), END_TIMEOUT_S)
        except TimeoutError:
            self._process.kill()  # a stopped process (SIGSTOP) reacts to no other signal


async def _last_message(process: asyncio.subprocess.Process) -> str:
    """Return the last line that a process wrote to stderr, once it has ended."""
    _, output = await process.communicate()
    lines = output.decode(errors="replace").strip().splitlines()
    return lines[-1].removeprefix("pneuforce: ") if lines else "its process has ended"
