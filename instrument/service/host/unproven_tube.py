"""File that exists while the tube is unproven, so that a restart does not forget a blocked tube."""

from __future__ import annotations

import asyncio
import logging
import os
from pathlib import Path

from pneuforce.instrument.core.state import InstrumentState
from pneuforce.instrument.service.host.repeated_warning import RepeatedWarning

log = logging.getLogger("pneuforce")

_TEXT = """\
pneuforce found a blocked tube, and no proof test has passed since: the balloon may be inflated although
the sensor reads 0 kPa. pneuforce removes this file after a proof test or a change of the balloon.
"""


def unproven_tube_file(event_log: Path) -> Path:
    """Return the path of the file that belongs to an event log."""
    return event_log.with_name(f"{event_log.name}.tube-unproven")


class UnprovenTube:
    """Output channel that writes the file when the tube becomes unproven, and removes the file afterwards.

    Another thread writes, because a slow disk must not delay the commands to the board.
    """

    def __init__(self, state: InstrumentState, file: Path) -> None:
        """Set the tube unproven if the file exists, also if its content cannot be read."""
        self._state = state
        self._file = file
        self._stored = os.path.lexists(file)
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
                self._file.unlink(missing_ok=True)
        except OSError as error:
            return f"{error.strerror}; check the disk and the rights of the folder"
        return ""

    def _write(self) -> None:
        with self._file.open("w", encoding="utf-8") as file:
            file.write(_TEXT)
            file.flush()
            os.fsync(file.fileno())
