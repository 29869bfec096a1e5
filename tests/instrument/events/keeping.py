"""Logs made by hand, and what a reader makes of them."""

from instrument.events.reading import opened
from instrument.events.record import Moment, Record, body_of
from instrument.events.store import Store
from instrument.events.verification import verified

MOMENT = Moment(1_800_000_000_000_000, 5.0)


def a_record(number, **facts):
    at = Moment(MOMENT.utc_us + number, MOMENT.mono_s + number)
    return Record(at, {"kind": "test", "which": number, **facts})


def written(path, numbers):
    """A log of these records, closed in good order."""
    store = Store(path)
    for number in numbers:
        store.append([body_of(a_record(number))])
    store.close()
    return path


def chain_of(path, head=None):
    with opened(path) as rows:
        return verified(rows, head)


class Memory:
    """A journal that keeps what it is given."""

    def __init__(self):
        self.records, self.trouble = [], ""

    def put(self, record):
        self.records.append(record)

    @property
    def told(self):
        """Facts of each record, in order."""
        return [dict(record.facts) for record in self.records]

    def of(self, kind):
        return [facts for facts in self.told if facts["kind"] == kind]
