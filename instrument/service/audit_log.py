"""Event log of a running instrument, from its start to its end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from pneuforce.errors import ConfigurationFileError, ServerError
from pneuforce.instrument.audit.audit_logger import AuditLogger, AuditSink, NullAuditSink
from pneuforce.instrument.audit.record import AuditRecord, record_body
from pneuforce.instrument.audit.store import EventLogFileError, EventLogInUse
from pneuforce.instrument.audit.writer import EventLogWriter
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.event_log_head import EventLogHead
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.broadcaster import EntryBroadcaster
from pneuforce.instrument.stream.entry import EntryKind
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.support.permissions import unreadable, write_problem


class PublishingAuditSink:
    """Audit sink that passes each record to another sink and publishes it to the stream."""

    def __init__(self, sink: AuditSink, broadcaster: EntryBroadcaster) -> None:
        self._sink = sink
        self._broadcaster = broadcaster

    @property
    def write_error(self) -> str:
        """Return the present write error, or an empty string."""
        return self._sink.write_error

    @property
    def head(self) -> EventLogHead:
        """Return the head of the records on the disk."""
        return self._sink.head

    def append(self, record: AuditRecord) -> None:
        """Write and publish one record."""
        self._sink.append(record)
        if self._broadcaster.subscribers:
            self._broadcaster.record(EntryKind.EVENT, record.at.mono_s, record_body(record))


def _opened(file: Path) -> EventLogWriter:
    """Return the writer of a file.

    Raises ConfigurationFileError if only a person can correct the reason why the file cannot be written. A
    full, failed or read-only disk does not prevent the start.
    """
    if problem := _write_problem(file):
        raise ConfigurationFileError(f"events.file: {problem}")
    try:
        return EventLogWriter(file)
    except EventLogInUse as error:  # the other instrument may end, so systemd tries again
        raise ServerError(f"events.file: {error}") from None
    except EventLogFileError as error:
        raise ConfigurationFileError(f"events.file: {error}") from None


def _write_problem(file: Path) -> str:
    try:
        return write_problem(file)
    except PermissionError:
        return unreadable(file)
    except OSError:  # of the disk
        return ""


@contextmanager
def audited(
    session: Session, configuration: Configuration, file: Path | None, broadcaster: EntryBroadcaster
) -> Iterator[AuditLogger]:
    """Yield the source for the buses. The source writes the event log and publishes its records.

    Without a `file`, the records are only published.

    Raises ConfigurationFileError if the file is not an event log or may not be written, and ServerError if
    another instrument writes the file.
    """
    writer = _opened(file) if file else None
    sink = PublishingAuditSink(writer or NullAuditSink(), broadcaster)
    audit_logger = AuditLogger(session, sink)
    identity = {
        "map_hash": f"{MAP_HASH:08x}",
        "configuration_hash": configuration.hash_text,
        "configuration_signature": str(configuration.signatures.configuration),
        "calibration_signature": str(configuration.signatures.calibration),
    }
    audit_logger.log_start(
        {"version": version("pneuforce"), **identity, "serial_number": configuration.identity.serial_number},
        time.monotonic(),
    )
    why = "stop requested"
    try:
        yield audit_logger
    except BaseException as error:
        why = str(error) or type(error).__name__
        raise
    finally:
        try:
            audit_logger.end(why, time.monotonic())
        finally:
            if writer is not None:
                writer.close()
