"""Unix socket for this user only, and its name in the file system."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from pneuforce.errors import ConfigurationFileError, ServerError
from pneuforce.support.permissions import folder_problem


class LocalSocket:
    """Listening Unix socket.

    `in_place` is False after the name was removed. `close` never removes the name of another socket.
    """

    def __init__(self, path: Path, new_client: Callable[[], asyncio.BaseProtocol]) -> None:
        self.path = path
        self._new_client = new_client
        self._server: asyncio.Server | None = None
        self._identity: tuple[int, int] | None = None

    async def open(self) -> None:
        """Listen.

        Raises ServerError if the name is in use or cannot be created. Raises ConfigurationFileError if the
        folder is missing or may not be written, because only a person can correct this.
        """
        try:
            _remove_stale(self.path)
            umask = os.umask(0o177)
            try:
                loop = asyncio.get_running_loop()
                self._server = await loop.create_unix_server(self._new_client, str(self.path))
            finally:
                os.umask(umask)
        except ServerError:  # ServerError is a subclass of OSError, and its message is complete
            raise
        except (FileNotFoundError, NotADirectoryError, PermissionError) as error:
            reason = _folder_reason(self.path) or error.strerror
            raise ConfigurationFileError(f"local.socket = {self.path}: {reason}") from None
        except OSError as error:
            raise ServerError(f"local.socket = {self.path}: {error.strerror or error}") from None
        self._identity = _identity(self.path)

    @property
    def in_place(self) -> bool:
        """Return True if the name in the file system still belongs to this socket."""
        return self._identity is not None and _identity(self.path) == self._identity

    def close(self) -> None:
        """Stop listening and remove the name if it still belongs to this socket."""
        if self._server is not None:
            self._server.close()
        if self.in_place:
            self.path.unlink(missing_ok=True)
        self._identity = None


def _folder_reason(path: Path) -> str:
    """Return why the socket cannot be created in its folder, "" if the folder is not the reason."""
    with suppress(PermissionError):
        if problem := folder_problem(path.parent):
            return f"{problem} (for a service, systemd creates /run/pneuforce)"
    return ""


def _identity(path: Path) -> tuple[int, int] | None:
    with suppress(OSError):
        status = path.lstat()
        return status.st_dev, status.st_ino
    return None


def _remove_stale(path: Path) -> None:
    """Remove a socket that no process serves.

    Raises ServerError if a process serves the socket, or if the path is not a socket.
    """
    with suppress(FileNotFoundError):
        if not stat.S_ISSOCK(path.lstat().st_mode):
            raise ServerError(f"local.socket = {path} is a file, not a socket: choose another name")
        with socket.socket(socket.AF_UNIX) as probe:
            answer = probe.connect_ex(str(path))
        if answer == 0:
            raise ServerError(
                f"local.socket = {path} belongs to another running instrument: choose another name"
            )
        if answer != errno.ECONNREFUSED:
            raise ServerError(
                f"local.socket = {path} belongs to another program ({os.strerror(answer)}): "
                "choose another name"
            )
        path.unlink()
