"""Helpers for tests of event logs: write records, verify a log, and keep records in memory."""

from pneuforce.instrument.audit.reading import open_event_log
from pneuforce.instrument.audit.record import AuditRecord, Timestamp, record_body
from pneuforce.instrument.audit.store import EventLogFile
from pneuforce.instrument.audit.verification import verify_chain
from pneuforce.instrument.core.event_log_head import EventLogHead

TIMESTAMP = Timestamp(1_800_000_000_000_000, 5.0)


def make_record(number, **fields):
    at = Timestamp(TIMESTAMP.utc_us + number, TIMESTAMP.mono_s + number)
    return AuditRecord(at, {"kind": "test", "which": number, **fields})


def make_log(path, numbers):
    """Append records with these numbers to a log, close the log, and return its path."""
    log = EventLogFile(path)
    for number in numbers:
        log.append([record_body(make_record(number))])
    log.close()
    return path


def verify_log(path, head=None):
    with open_event_log(path) as rows:
        return verify_chain(rows, head)


class MemorySink:
    """Audit sink that keeps all records in memory."""

    def __init__(self):
        self.records, self.write_error, self.head = [], "", EventLogHead()

    def append(self, record):
        self.records.append(record)

    @property
    def fields(self):
        """Return the fields of each record, in order."""
        return [dict(record.fields) for record in self.records]

    def of_kind(self, kind):
        return [fields for fields in self.fields if fields["kind"] == kind]
