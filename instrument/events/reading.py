"""Reading a log, also while an instrument writes it: neither the file nor what lies beside it is changed."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote

from instrument.errors import ConfigurationError
from instrument.events.store import check_identity
from instrument.events.verification import Row

LOWEST = -(2**63)  #: of SQLite's numbers: who looks for what was altered must not overlook one below 1


class Damaged(Exception):
    """A file that SQLite cannot read on."""


class NoLog(Damaged):
    """A file of which SQLite can read nothing."""


@contextmanager
def opened(path: Path, first: int = LOWEST) -> Iterator[Iterator[Row]]:
    """The records of a log from number `first` on, in order, as they lie in the file.

    Raises ConfigurationError: no such file, no event log; Damaged, also while the rows are read.
    """
    with ExitStack() as stack:
        stack.enter_context(_damage_in_words(path))
        file, option = _openable(path, stack)
        uri = f"file:{quote(str(file.absolute()))}?{option}"
        db = stack.enter_context(closing(sqlite3.connect(uri, uri=True, isolation_level=None)))
        db.text_factory = bytes  # a damaged text is still to be judged
        yield _rows(db, path, first)


def _rows(db: sqlite3.Connection, path: Path, first: int) -> Iterator[Row]:
    if check_identity(db, path):
        wanted = "SELECT number, body, seal FROM records WHERE number >= ? ORDER BY number"
        for row in db.execute(wanted, (first,)):
            yield Row(*row)


@contextmanager
def _damage_in_words(path: Path) -> Iterator[None]:
    try:
        yield
    except sqlite3.Error as error:
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_NOTADB:
            raise NoLog(f"{path} is not an event log, or its beginning is destroyed") from None
        raise Damaged(f"{path} cannot be read on: {error}") from None


def _openable(path: Path, stack: ExitStack) -> tuple[Path, str]:
    """What to open, and how, so that SQLite leaves no file of its own beside it, and takes none away.

    Without a write-ahead log nobody writes. With one and its index an instrument runs or was killed, and both
    are there already. With one and no index these are copies, and the index is made beside further copies.
    One that lies beside an empty file is another log's, and SQLite would delete it.
    """
    if not path.is_file() or not os.access(path, os.R_OK):
        raise ConfigurationError(f"{path}: no such file, or not to be read by you")
    ahead, index = (Path(f"{path}{end}") for end in ("-wal", "-shm"))
    if not path.stat().st_size or not ahead.exists() or not ahead.stat().st_size:
        return path, "immutable=1"
    if index.exists():
        return path, "mode=ro"
    copy = Path(stack.enter_context(TemporaryDirectory(prefix="pneuforce-"))) / "events"
    shutil.copyfile(path, copy)
    shutil.copyfile(ahead, f"{copy}-wal")
    return copy, "mode=ro"
