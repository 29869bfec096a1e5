"""Users who may log in on the page, read again whenever their file has changed."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from pathlib import Path

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.users.file import User, load_users
from pneuforce.support.background import run_in_background

CHECK_PERIOD_S = 0.5
_log = logging.getLogger("pneuforce")

#: Facts that differ after each change of a file: time of the change [ns], size, inode.
FileVersion = tuple[int, int, int]


class UserDirectory:
    """Users of a file. While the file is damaged, it has no users, so that all logins end."""

    def __init__(self, path: Path | None) -> None:
        """Read the file for the first time. None disables logins."""
        self.users: Mapping[str, User] = {}
        self.problem = ""  #: why the file cannot be used; empty if it can
        self._path = path
        self._version: FileVersion | None = None
        self._update(*self._read())

    async def run(self) -> None:
        """Read the file after each change, until cancelled. A slow disk does not delay the event loop."""
        while self._path is not None:
            await asyncio.sleep(CHECK_PERIOD_S)
            self._update(*await run_in_background(self._read))

    def _read(self) -> tuple[FileVersion | None, Mapping[str, User], str]:
        """Return the version of the file, its users, and its problem."""
        if self._path is None:
            return None, {}, ""
        version = _version_of(self._path)
        if version is not None and version == self._version:
            return version, self.users, self.problem
        try:
            return version, load_users(self._path), ""
        except ConfigurationError as error:
            return version, {}, str(error)

    def _update(self, version: FileVersion | None, users: Mapping[str, User], problem: str) -> None:
        if problem and problem != self.problem:
            _log.warning("web: no user can log in: %s", problem)
        elif self.problem and not problem:
            _log.info("web: the file of the users can be read again: the users can log in")
        self._version, self.users, self.problem = version, users, problem


def _version_of(path: Path) -> FileVersion | None:
    """Return the version of a file; None if the file is missing or inaccessible."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino
