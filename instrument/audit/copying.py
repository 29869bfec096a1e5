"""Copy of an event log. An instrument may write the log at the same time."""

from __future__ import annotations

import errno
import os
import sqlite3
from contextlib import closing
from pathlib import Path

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.reading import converted_errors, open_event_log
from pneuforce.instrument.audit.store import FILE_MODE, check_file_type
from pneuforce.instrument.audit.verification import VerifiedChain, verify_chain
from pneuforce.support.readonly_sqlite import open_readonly

#: Errors of the copy. The log is only read.
_WRITE_ERRORS = {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR_WRITE, sqlite3.SQLITE_IOERR_FSYNC}


def copy_event_log(source: Path, copy: Path) -> VerifiedChain:
    """Copy an event log to a new file, and return the verified chain of the copy.

    The copy contains the state of the log at one time. The log is only read, and the instrument continues to
    write. Raises ConfigurationError if there is no event log, DamagedLogError if SQLite cannot read it,
    BrokenChainError if a record is wrong, and OSError if the copy cannot be written.
    """
    os.close(os.open(copy, os.O_WRONLY | os.O_CREAT | os.O_EXCL, FILE_MODE))
    with converted_errors(source), closing(open_readonly(source)) as log:
        if not check_file_type(log, source):
            raise ConfigurationError(
                f"{source} contains no record: was the log moved without the file that ends in -wal?"
            )
        _copy_pages(log, copy)
    with open_event_log(copy) as rows:
        return verify_chain(rows)


def _copy_pages(log: sqlite3.Connection, copy: Path) -> None:
    """Copy all pages in one read transaction, so that they belong together."""
    with closing(sqlite3.connect(copy)) as target:
        target.execute("PRAGMA journal_mode = MEMORY")  # a failed copy is deleted, and needs no journal
        try:
            log.backup(target)
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode in _WRITE_ERRORS:
                raise OSError(errno.EIO, str(error)) from None
            raise
