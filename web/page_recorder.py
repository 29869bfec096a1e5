"""Recording that an operator starts on the web page: a process `pneuforce record` in the configured folder.

The recording continues when the browser disconnects. It ends on request, at a limit, with the instrument, and
with the web process, because the recorder ends when its stdin is closed.
"""

from __future__ import annotations

import asyncio
import json
import math
import sys
import time
from asyncio.subprocess import PIPE, Process
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.web.event_stream import SseMessage

SUFFIX = ".recording"
START_TIMEOUT_S = 15.0
END_TIMEOUT_S = 3.0
EARLIER_RECORDER_S = 10.0  #: time that the recorder of an earlier web process may need to end
POLL_S = 0.05
STATUS_PERIOD_S = 1.0
MAX_LISTED = 20  #: number of latest recordings that the page lists
NO_END = "the recorder was killed or could not write"
DISABLED = "Recordings are disabled. Set [web] recordings in the configuration to a folder."


class RecordingRejected(Exception):
    """A recording cannot start or end now. The message is one sentence for the operator."""


class RecordingFolder(NamedTuple):
    """Folder of the recordings, and limits of each recording [MB]."""

    path: Path | None  #: None disables recordings on the page
    max_mb: float
    min_free_mb: float


class PageRecorder:
    """At most one recording at a time, and the list of the finished recordings."""

    def __init__(self, folder: RecordingFolder, socket: Path) -> None:
        self._folder = folder
        self._socket = socket
        self._process: Process | None = None
        self._file = Path()
        self._started_s = 0.0
        self._is_starting = False  #: the recorder runs, and its file does not exist yet
        self._monitoring: asyncio.Task[None] | None = None
        self._starting = asyncio.Lock()
        self._bytes = 0  # size of the recording in progress
        self._last: dict[str, Any] | None = None  # result of the last recording
        self._finished: dict[str, int] = {}
        self._changed = True

    @property
    def active(self) -> bool:
        """Return True while a recorder runs."""
        return self._process is not None

    async def run(self) -> None:
        """Update the state once per second while a recording is in progress.

        All disk access runs in threads, because a disk that does not respond must not delay a vent.
        """
        await self._read_folder()
        while True:
            self._changed = True
            await asyncio.sleep(STATUS_PERIOD_S)
            while not self.active:
                await asyncio.sleep(STATUS_PERIOD_S)
            self._bytes = await asyncio.to_thread(_size, self._file)

    async def _read_folder(self) -> None:
        """Find the finished recordings and the result of the latest one.

        The recorder of an earlier web process may need some seconds to end.
        """
        folder = self._folder.path
        until_s = time.monotonic() + EARLIER_RECORDER_S
        while await asyncio.to_thread(_is_written, folder) and time.monotonic() < until_s:
            await asyncio.sleep(POLL_S)
        self._finished = await asyncio.to_thread(_find_finished, folder)
        last = await asyncio.to_thread(_read_last, folder)
        if not self.active:
            self._last = self._last or last

    # ---- requests

    async def start(self) -> None:
        """Start a recording, and return when its file exists. Raises RecordingRejected."""
        async with self._starting:
            await self._start()

    async def _start(self) -> None:
        folder = self._folder.path
        if folder is None:
            raise RecordingRejected(DISABLED)
        if self.active:
            raise RecordingRejected("A recording is in progress. Stop this recording first.")
        now = datetime.now(UTC)
        file = folder / f"{now:%Y%m%dT%H%M%SZ}{SUFFIX}"
        try:
            await asyncio.to_thread(folder.mkdir, 0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingRejected(f"The folder {folder} cannot be created: {error.strerror}.") from None
        self._file, self._started_s, self._bytes, self._last = file, time.monotonic(), 0, None
        self._is_starting = True
        await self._start_process()
        if why := await self._wait_for_file():
            raise RecordingRejected(f"The recording does not start: {why}.")
        self._started_s, self._is_starting, self._changed = time.monotonic(), False, True

    async def _wait_for_file(self) -> str:
        """Wait until the file exists or the recorder has ended. Return why there is no recording, or "".

        The recorder is ended if there is no file after `START_TIMEOUT_S`.
        """
        while self.active and not await asyncio.to_thread(self._file.exists):
            if time.monotonic() > self._started_s + START_TIMEOUT_S:
                await self.close()
                return f"the recorder has created no file within {START_TIMEOUT_S:g} s"
            await asyncio.sleep(POLL_S)
        return self._last["text"] if self._last and not self._last["complete"] else ""

    async def stop(self) -> None:
        """End the recording, and return when its file is complete. Raises RecordingRejected."""
        if self._process is None:
            raise RecordingRejected("No recording is in progress.")
        if not await self.close():
            raise RecordingRejected("The recorder still writes to the disk. Wait until the recording ends.")

    async def close(self) -> bool:
        """Request the end of a recording. Return False if the recorder still runs after `END_TIMEOUT_S`."""
        if self._process is None or self._monitoring is None:
            return True
        assert self._process.stdin is not None
        self._process.stdin.close()
        await asyncio.wait([self._monitoring], timeout=END_TIMEOUT_S)
        return not self.active

    def finished_file(self, name: object) -> Path | None:
        """Return the path of a finished recording, None if no finished recording has this name."""
        folder = self._folder.path
        return folder / name if folder and isinstance(name, str) and name in self._finished else None

    # ---- process

    async def _start_process(self) -> None:
        limits = ("--max-mb", f"{self._folder.max_mb}", "--min-free-mb", f"{self._folder.min_free_mb}")
        command = (sys.executable, "-P", "-m", "pneuforce", "record", str(self._file))
        options = ("--socket", str(self._socket), *limits, "--until-stdin-closes", "--json")
        try:
            self._process = await asyncio.create_subprocess_exec(
                *command, *options, stdin=PIPE, stdout=PIPE, stderr=PIPE, start_new_session=True
            )
        except OSError as error:
            raise RecordingRejected(f"The recorder cannot be started: {error.strerror}.") from None
        self._monitoring = asyncio.create_task(self._monitor(self._process))

    async def _monitor(self, process: Process) -> None:
        """Wait for the end of the recorder, and store its result."""
        assert process.stdout is not None
        assert process.stderr is not None
        output, errors = await asyncio.gather(process.stdout.read(), process.stderr.read())
        code = await process.wait()
        self._finished = await asyncio.to_thread(_find_finished, self._folder.path)
        self._last = {"file": self._file.name, "complete": code == 0, **_result(output, errors)}
        self._process, self._changed = None, True

    # ---- messages to the browsers

    def message(self) -> SseMessage:
        """Return the state of the recording, the result of the last one, and the finished recordings.

        The time of an active recording is null until its file exists: nothing is recorded before.
        """
        active = None
        if self.active:
            seconds = None if self._is_starting else round(time.monotonic() - self._started_s, 1)
            active = {"file": self._file.name, "seconds": seconds, "bytes": self._bytes}
        finished = [{"file": name, "bytes": size} for name, size in self._finished.items()]
        enabled = self._folder.path is not None
        return SseMessage(
            "recording", {"enabled": enabled, "active": active, "last": self._last, "finished": finished}
        )

    def due_messages(self) -> list[SseMessage]:
        """Return the state after a change, and each `STATUS_PERIOD_S` while a recording is in progress."""
        is_due, self._changed = self._changed, False
        return [self.message()] if is_due else []


def _find_finished(folder: Path | None) -> dict[str, int]:
    """Return the names and sizes of the latest finished recordings, latest first."""
    found: dict[str, int] = {}
    with suppress(OSError):
        for file in sorted(folder.glob(f"*{SUFFIX}") if folder else (), reverse=True)[:MAX_LISTED]:
            if not _log_size(file):
                found[file.name] = file.stat().st_size
    return found


def _read_last(folder: Path | None) -> dict[str, Any] | None:
    """Return the result of the latest recording as its file states it; None without a readable recording.

    A recording that ended together with an earlier web process has no other result.
    """
    with suppress(ConfigurationError, OSError, ValueError):
        file = max(folder.glob(f"*{SUFFIX}") if folder else ())
        with open_recording(file) as recording:
            ending, extent_s = recording.ending, recording.extent_s
        return {
            "file": file.name,
            "complete": ending is not None and ending.how in (EndReason.END, EndReason.STOPPED),
            "seconds": round(extent_s, 1) if math.isfinite(extent_s) else None,
            "bytes": _size(file),
            "text": ": ".join(filter(None, (ending.how, ending.why))) if ending else NO_END,
        }
    return None


def _is_written(folder: Path | None) -> bool:
    """Return True if a recorder possibly still writes into a folder."""
    with suppress(OSError):
        return any(map(_log_size, folder.glob(f"*{SUFFIX}") if folder else ()))
    return False


def _size(file: Path) -> int:
    """Return the size of a recording with its write-ahead log; 0 if there is none."""
    with suppress(OSError):
        return file.stat().st_size + _log_size(file)
    return 0


def _log_size(file: Path) -> int:
    """Return the size of the write-ahead log of a recording; 0 if there is none.

    A log without content means that the recording has ended (see `open_readonly`). SQLite leaves such a log
    behind if a program reads the recording when its recorder ends.
    """
    with suppress(OSError):
        return Path(f"{file}-wal").stat().st_size
    return 0


def _result(output: bytes, errors: bytes) -> dict[str, Any]:
    """Return the duration [s], the size, and the reason of the end from the output of a recorder."""
    lines = errors.decode(errors="replace").strip().splitlines()
    try:
        facts = json.loads(output)
        if "ended" not in facts:  # the recording did not start
            return {"seconds": None, "bytes": None, "text": facts["message"]}
        text = ": ".join(filter(None, (facts["ended"], facts["why"])))
        return {"seconds": facts["seconds"], "bytes": facts["bytes"], "text": text}
    except (ValueError, KeyError, TypeError):
        text = lines[-1].removeprefix("pneuforce: ") if lines else "the recorder has ended without a message"
        return {"seconds": None, "bytes": None, "text": text}
