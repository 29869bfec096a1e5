"""A Unix socket that is listened on for this user alone, and its name in the file system."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from instrument.errors import FaceError


class LocalSocket:
    """Listens at a path, knows whether that name still is its own, and removes no other's."""

    def __init__(self, path: Path, new_guest: Callable[[], asyncio.Protocol]) -> None:
        self.path = path
        self._new_guest = new_guest
        self._server: asyncio.Server | None = None
        self._identity: tuple[int, int] | None = None

    async def open(self) -> None:
        """Listen. Raises FaceError: the name is taken, or cannot be had."""
        try:
            _make_free(self.path)
            umask = os.umask(0o177)
            try:
                loop = asyncio.get_running_loop()
                self._server = await loop.create_unix_server(self._new_guest, str(self.path))
            finally:
                os.umask(umask)
        except FaceError:  # an OSError too, that has its sentence
            raise
        except OSError as error:
            raise FaceError(f"local.socket = {self.path}: {_why(self.path, error)}") from None
        self._identity = _identity(self.path)

    @property
    def in_place(self) -> bool:
        """Whether who looks for the name finds this socket."""
        return self._identity is not None and _identity(self.path) == self._identity

    def close(self) -> None:
        """Listen no longer; the name goes, if it is still this socket's."""
        if self._server is not None:
            self._server.close()
        if self.in_place:
            self.path.unlink(missing_ok=True)
        self._identity = None


def _why(path: Path, error: OSError) -> str:
    if path.parent.is_dir():
        return error.strerror or str(error)
    return f"there is no folder {path.parent}: make it (for a service systemd does), or name another"


def _identity(path: Path) -> tuple[int, int] | None:
    with suppress(OSError):
        found = path.lstat()
        return found.st_dev, found.st_ino
    return None


def _make_free(path: Path) -> None:
    """Remove a socket that nobody serves any more. Raises FaceError where somebody does, or it is a file."""
    with suppress(FileNotFoundError):
        if not stat.S_ISSOCK(path.lstat().st_mode):
            raise FaceError(f"local.socket = {path} is a file that is no socket: name another")
        with socket.socket(socket.AF_UNIX) as probe:
            answer = probe.connect_ex(str(path))
        if answer == 0:
            raise FaceError(f"local.socket = {path} is another running instrument's: give each its own")
        if answer != errno.ECONNREFUSED:
            raise FaceError(
                f"local.socket = {path} is another program's ({os.strerror(answer)}): name another"
            )
        path.unlink()
