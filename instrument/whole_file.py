"""Files that are read whole, and files that appear only when they are whole."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from instrument.errors import ConfigurationError

MOST_BYTES = 100_000_000
#: The one pipe that is read: whoever gives it to us writes it.
STDIN = Path("/dev/stdin")


def content_of(path: Path, remedy: str = "") -> bytes:
    """All bytes of a file. Raises ConfigurationError; `remedy` tells how to get such a file."""
    try:
        path.stat()
        if path != STDIN:
            _check_regular(path, "read")
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise ConfigurationError(f"{path}: no such file{f' ({remedy})' if remedy else ''}") from None
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror or error}") from None
    if len(content) > MOST_BYTES:
        raise ConfigurationError(f"{path}: more than {MOST_BYTES // 1_000_000} MB")
    return content


def check_writable(path: Path) -> None:
    """Raises ConfigurationError where `write` would fail now; an old file is left alone."""
    _write(path, (), keep=False)


def write(path: Path, lines: Iterable[str]) -> None:
    """Write lines beside the file and then in its place: an old one stays until the new one is whole.

    Raises ConfigurationError.
    """
    _write(path, (line.encode() for line in lines), keep=True)


@contextmanager
def in_place_of(path: Path, keep: bool = True) -> Iterator[Path]:
    """A name beside the file; what is written there takes the file's place when it is whole.

    Raises ConfigurationError where that fails.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        if path.exists():
            _check_regular(path, "written")
        try:
            yield beside
            if keep:
                beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be written: {error.strerror or error}") from None


def _write(path: Path, pieces: Iterable[bytes], keep: bool) -> None:
    with in_place_of(path, keep) as beside, beside.open("wb") as file:
        file.writelines(pieces)


def _check_regular(path: Path, done: str) -> None:
    """A device or a pipe may have no end, and must not be replaced by a file."""
    if not path.is_file():
        raise ConfigurationError(f"{path}: cannot be {done}: not a regular file")
