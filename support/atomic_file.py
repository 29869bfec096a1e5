"""Reading of whole files, and writing of files: a new file replaces an old file only when it is complete."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex

from pneuforce.errors import ConfigurationError
from pneuforce.support.permissions import unreadable
from pneuforce.support.write_error import write_error

MAX_BYTES = 100_000_000
#: Standard input, the only pipe that may be read: a user chooses its content on purpose.
STDIN = Path("/dev/stdin")


@contextmanager
def replaced_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path`. After the with block, rename the file to `path`.

    An old file stays until the new file is complete. Raises OSError if the file cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.{token_hex(4)}")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def read_file(path: Path, remedy: str = "") -> bytes:
    """Return all bytes of a file.

    Raises ConfigurationError if the file is missing, unreadable, larger than 100 MB or not a regular file.
    `remedy` is added to the message for a missing file and says how to get such a file.
    """
    try:
        path.stat()
        if path != STDIN:
            _check_regular(path, "read")
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        remedy = remedy or "check the name and the folder"
        raise ConfigurationError(f"{path}: no such file ({remedy})") from None
    except PermissionError:
        raise ConfigurationError(f"{path}: {unreadable(path)}") from None
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror or error}") from None
    if len(content) > MAX_BYTES:
        raise ConfigurationError(f"{path}: larger than {MAX_BYTES // 1_000_000} MB")
    return content


def check_writable(path: Path) -> None:
    """Raise ConfigurationError if `write_lines` would fail now. An existing file is not changed."""
    with _errors_of(path):
        temporary = path.with_name(f".{path.name}.{os.getpid()}.{token_hex(4)}")
        temporary.touch()
        temporary.unlink()


def check_new(path: Path, overwrite: bool) -> None:
    """Raise ConfigurationError if a file cannot be written, or if it exists and `overwrite` is False."""
    check_writable(path)
    if path.exists() and not overwrite:
        raise ConfigurationError(
            f"{path} exists already: name another file, or replace the file with --overwrite"
        )


def write_lines(path: Path, lines: Iterable[str]) -> None:
    """Write lines to a file. An old file stays until the new file is complete.

    Raises ConfigurationError if the file cannot be created, WriteFailed if the disk is full.
    """
    with replaced_user_file(path) as temporary, temporary.open("wb") as file:
        file.writelines(line.encode() for line in lines)


@contextmanager
def replaced_user_file(path: Path) -> Iterator[Path]:
    """Do the same as `replaced_file`, but raise ConfigurationError or WriteFailed instead of OSError."""
    with _errors_of(path), replaced_file(path) as temporary:
        yield temporary


@contextmanager
def _errors_of(path: Path) -> Iterator[None]:
    try:
        if path.exists():
            _check_regular(path, "written")
        yield
    except OSError as error:
        raise write_error(path, error) from None


def _check_regular(path: Path, action: str) -> None:
    """Raise ConfigurationError for a device or a pipe, which may be endless and must not be replaced."""
    if not path.is_file():
        reason = "it is a folder: name a file" if path.is_dir() else "not a regular file"
        raise ConfigurationError(f"{path}: cannot be {action}: {reason}")
