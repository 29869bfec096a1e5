"""File that exists while the tube is unproven, so that a restart does not forget a blocked tube."""

from __future__ import annotations

import asyncio
import logging
import os
from pathlib import Path

from pneuforce.instrument.core.state import InstrumentState
from pneuforce.instrument.service.host.repeated_warning import RepeatedWarning

log = logging.getLogger("pneuforce")

PREFIX = "tube-unproven-"
MAX_CHARACTERS = 10_000  #: of a file of another instrument that are read
_TEXT = """\
rig: {port}
pneuforce found a blocked tube, and no proof test has passed since: the balloon may be inflated although
the sensor reads 0 kPa. pneuforce removes this file after a proof test or a change of the balloon.
"""


def unproven_tube_file(event_log: Path) -> Path:
    """Return the path of the file that belongs to an event log.

    The name does not begin with that of the log, so that `mv events.sqlite*` does not move this file.
    """
    return event_log.with_name(f"{PREFIX}{event_log.name}")


def _files_of_rig(folder: Path, port: str) -> list[Path]:
    """Return the files in a folder that an instrument with the same rig has written, with any event log."""
    return [file for file in folder.glob(f"{PREFIX}*") if _first_line(file) == f"rig: {port}"]


def _first_line(file: Path) -> str:
    try:
        with file.open(encoding="utf-8", errors="replace") as text:
            return text.readline(MAX_CHARACTERS).rstrip("\n")
    except OSError:
        return ""


class UnprovenTube:
    """Output channel that writes the file when the tube becomes unproven, and removes the file afterwards.

    Another thread writes, because a slow disk must not delay the commands to the board.
    """

    def __init__(self, state: InstrumentState, file: Path, port: str) -> None:
        """Set the tube unproven if the file exists, also if its content cannot be read.

        A file that belongs to another event log in the same folder counts as well if it names the same rig:
        `port` is the serial port of the rig.
        """
        self._state = state
        self._file = file
        self._port = port
        self._files = {file, *_files_of_rig(file.parent, port)}
        self._stored = any(map(os.path.lexists, self._files))
        self._writing: asyncio.Future[str] | None = None
        self._failed = RepeatedWarning(log, f"{file}: a restart would forget the blocked tube")
        state.proof_tests.tube_unproven |= self._stored

    def on_sample(self, now_s: float) -> None:
        """Do nothing: the time of a sample does not matter."""

    def tick(self, now_s: float) -> None:
        """Begin to write or remove the file if the state has changed. Try again if this has failed."""
        if self._writing is not None:
            if not self._writing.done():
                return
            self._finish(self._writing, now_s)
        if self._state.proof_tests.tube_unproven != self._stored:
            self._writing = asyncio.get_running_loop().run_in_executor(None, self._store, not self._stored)

    def _finish(self, writing: asyncio.Future[str], now_s: float) -> None:
        self._writing = None
        if error := writing.result():
            self._failed.warn(error, now_s)
        else:
            self._stored = not self._stored
            self._failed.reset()

    def _store(self, unproven: bool) -> str:
        """Write the file, or remove it. Return "", or why this has failed."""
        try:
            if unproven:
                self._write()
            else:
                for file in self._files:
                    file.unlink(missing_ok=True)
        except OSError as error:
            return f"{error.strerror}; check the disk and the rights of the folder"
        return ""

    def _write(self) -> None:
        with self._file.open("w", encoding="utf-8") as file:
            file.write(_TEXT.format(port=self._port))
            file.flush()
            os.fsync(file.fileno())
