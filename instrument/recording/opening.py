"""Opening of a recording for reading, with a check of the file type and the version."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.recording.reader import EMPTY_REASON, Recording, short_text
from pneuforce.instrument.recording.schema import APPLICATION, TABLES, VERSION
from pneuforce.support.readonly_sqlite import open_readonly, reject_generated_columns

#: Query for a column `number` that is not the key. The time to read a long table would then grow with the
#: square of its length.
_OTHER_ROW_NUMBER = """
    SELECT 1 FROM pragma_table_info(?) WHERE name = 'number' AND NOT (type = 'INTEGER' AND pk = 1)
"""


@contextmanager
def open_recording(path: Path) -> Iterator[Recording]:
    """Open a recording for reading.

    Raises ConfigurationError if the file is missing, is not a recording or cannot be read at all.
    """
    try:
        db = open_readonly(path)
    except sqlite3.Error as error:
        raise ConfigurationError(f"{path} cannot be opened: {error}") from None
    with closing(db):
        try:
            _check_file_type(db, path)
            recording = Recording(path, db)
        except sqlite3.DatabaseError as error:
            raise ConfigurationError(
                f"{path} is not a recording, or its beginning is destroyed ({short_text(error)})"
            ) from None
        yield recording


def _check_file_type(db: sqlite3.Connection, path: Path) -> None:
    if not path.stat().st_size:
        raise ConfigurationError(f"{path} is empty, so it is not a recording")
    db.execute("PRAGMA writable_schema = ON")  # allows SQLite to read a truncated file
    db.execute("PRAGMA cell_size_check = ON")
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application == 0 and not db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
        raise ConfigurationError(f"{path} contains no recording ({EMPTY_REASON})")
    if application != APPLICATION:
        raise ConfigurationError(f"{path} is the database of another program, not a recording")
    if version != VERSION:
        raise ConfigurationError(
            f"{path} is a recording of format version {version}, and this program reads version {VERSION} "
            "only: read the file with the version of pneuforce that made the recording"
        )
    reject_generated_columns(db, path)
    for table in TABLES:
        if db.execute(_OTHER_ROW_NUMBER, (table,)).fetchone():
            raise ConfigurationError(f"{path} is not a recording: the table {table} has no row numbers")
