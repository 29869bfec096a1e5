"""File that contains the control port of a running simulator, next to the link to its serial port."""

from __future__ import annotations

import errno
import fcntl
import os
import re
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pneuforce.support.simulator_link import control_port_file

#: Content of the file. The file is empty if its simulator was killed during the start.
_CONTENT = re.compile(rb"(\d{1,5}\n)?")
_MAX_BYTES = 6
LOCK_RETRIES, LOCK_RETRY_S = 5, 0.01
_MODE = 0o644  #: only this user may write the file, because clients trust its content
#: A symbolic link is not followed, a pipe does not block, and a terminal does not take over this process.
_FLAGS = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC


@contextmanager
def port_file(link: Path | None, port: int) -> Iterator[None]:
    """Keep the control port in a file next to the link, for clients that have only the path of the link.

    The file is locked until the process ends. Raises FileExistsError if another simulator uses the link, or
    if something else has the name of the file. Raises OSError if the file cannot be created.
    """
    if link is None:
        yield
        return
    if not link.name:
        raise IsADirectoryError(f"{link} is a folder: choose another --link")
    path = control_port_file(link)
    descriptor = _locked(path, link)
    try:
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"{port}\n".encode(), 0)
        yield
    finally:
        if _is_at(descriptor, path):
            path.unlink()
        os.close(descriptor)


def _locked(path: Path, link: Path) -> int:
    """Open or create the file, and lock it. Return its descriptor."""
    while True:
        descriptor = _opened(path)
        try:
            if not _is_port_file(descriptor):
                raise _foreign(path)
            _lock(descriptor)
            if _is_at(descriptor, path):
                return descriptor
        except BlockingIOError:
            port = os.pread(descriptor, _MAX_BYTES, 0).decode().strip()
            os.close(descriptor)
            raise FileExistsError(
                f"{link} is in use by a running simulator (control port {port}): "
                "end that simulator, or choose another --link"
            ) from None
        except OSError:
            os.close(descriptor)
            raise
        os.close(descriptor)  # another simulator has ended between open and flock, and has removed the file


def _lock(descriptor: int) -> None:
    """Lock an open file. Raises BlockingIOError if another simulator has locked it.

    A program that only checks for a lock (`is_left_behind`) holds one for less than a millisecond.
    """
    for _ in range(LOCK_RETRIES):
        with suppress(BlockingIOError):
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        time.sleep(LOCK_RETRY_S)
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _opened(path: Path) -> int:
    """Open the file, or create it if nothing has this name. Return its descriptor."""
    while True:
        try:
            return os.open(path, _FLAGS)
        except FileNotFoundError:
            with suppress(FileExistsError):  # another simulator has created it at the same time
                return os.open(path, _FLAGS | os.O_CREAT | os.O_EXCL, _MODE)
        except OSError as error:
            if error.errno in (errno.ENAMETOOLONG, errno.ENOTDIR):
                raise
            raise _foreign(path) from None


def _is_port_file(descriptor: int) -> bool:
    """Return True if a simulator of this user has created the open file."""
    status = os.fstat(descriptor)
    return (
        stat.S_ISREG(status.st_mode)
        and status.st_uid == os.geteuid()
        and status.st_nlink <= 1
        and status.st_size <= _MAX_BYTES
        and _CONTENT.fullmatch(os.pread(descriptor, _MAX_BYTES, 0)) is not None
    )


def _foreign(path: Path) -> FileExistsError:
    return FileExistsError(
        f"{path} is not a file of a simulator of this user: choose another --link, or move that file"
    )


def _is_at(descriptor: int, path: Path) -> bool:
    """Return True if an open file is still the file at `path`."""
    with suppress(OSError):
        return os.path.samestat(os.fstat(descriptor), path.lstat())
    return False
