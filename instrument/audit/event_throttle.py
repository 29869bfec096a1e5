"""Event throttle: repetitions and floods of events are counted instead of logged one by one.

A PLC that repeats its writes for years, or a hostile peer, therefore cannot fill the disk.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from pneuforce.instrument.audit.record import AuditRecord, RecordFields, Timestamp, iso_utc
from pneuforce.support.throttle import TokenBucket

REPETITION_END_S = 60.0  #: a repetition has ended if the event did not occur again within this time
REPORT_INTERVAL_S = 3600.0  #: a repetition that continues is reported once per interval
BURST = 200.0  #: number of records of one peer and one grade that are logged without a delay between them
#: Highest mean rate of logged records of one peer, by grade. The rate is lowest for rejected requests,
#: because a hostile peer can send them for months.
RECORDS_PER_S = {"vent": 20.0, "accepted": 20.0, "rejected": 1.0}
MAX_REMEMBERED_EVENTS = 32  #: number of different events of one peer whose repetitions are detected
MAX_PEERS = 64  #: number of peers that have their own history; all other peers share one history

Peer = tuple[str, str]
OTHERS: Peer = ("others", "")


class AuditEvent(NamedTuple):
    """Action of a peer: a write, or a request that was rejected before it reached the instrument."""

    fields: RecordFields
    #: Names of the written quantities, or the rejected request. An event is a repetition if its key equals
    #: the key of the previous event with the same subject.
    subject: Hashable
    key: Hashable
    grade: str  #: vent, accepted or rejected; each grade has its own rate limit
    changed: bool = False  #: the event changed a quantity, so it is never a repetition
    times: int = 1  #: number of equal events


@dataclass(slots=True)
class EventCounter:
    """Counter of events that are not logged one by one."""

    kind: str
    last: Timestamp
    fields: RecordFields
    key: Hashable = None
    grade: str = ""
    times: int = 0
    since: Timestamp | None = None

    def add(self, at: Timestamp, times: int = 1) -> None:
        """Count one event, or `times` events."""
        self.since = self.since or at
        self.times += times
        self.last = at

    def report(self) -> list[RecordFields]:
        """Return the fields of a record about the counted events, if any were counted. Reset the counter."""
        if self.since is None:
            return []
        counted = {name: value for name, value in self.fields.items() if name != "who"}
        report = {
            "kind": self.kind,
            "who": self.fields.get("who"),
            "times": self.times,
            "since": iso_utc(self.since),
            "until": iso_utc(self.last),
            "of": counted,
        }
        self.times, self.since = 0, None
        return [report]

    def is_due(self, at: Timestamp) -> bool:
        """Return True if events were counted for longer than the report interval."""
        return self.since is not None and at.mono_s - self.since.mono_s > REPORT_INTERVAL_S

    def has_ended(self, at: Timestamp) -> bool:
        """Return True if the last event was so long ago that the repetition has ended."""
        return at.mono_s - self.last.mono_s > REPETITION_END_S


@dataclass(slots=True)
class _PeerHistory:
    """Counters and rate limits of one peer, or of all peers that share a history."""

    shared_name: str = ""  # name of a shared history; empty for the history of one peer
    # Counters of repetitions, by subject. The event that occurred least recently is the first.
    repeated: dict[Hashable, EventCounter] = field(default_factory=dict)
    held_back: dict[Hashable, EventCounter] = field(default_factory=dict)  # events above the rate, by grade
    buckets: dict[str, TokenBucket] = field(default_factory=dict)  # rate limits, by grade

    def filter(self, event: AuditEvent, at: Timestamp) -> list[AuditRecord]:
        previous = self.repeated.pop(event.subject, None)
        if previous is not None and previous.key == event.key and not event.changed:
            self.repeated[event.subject] = previous
            previous.add(at, event.times)
            return []
        counter = EventCounter("repeated", at, event.fields, event.key, event.grade)
        self.repeated[event.subject] = counter
        if event.times > 1:
            counter.add(at, event.times - 1)
        ended = [previous] if previous else []
        if len(self.repeated) > MAX_REMEMBERED_EVENTS:
            ended.append(self.repeated.pop(next(iter(self.repeated))))
        records = [
            record
            for counter in ended
            for fields in counter.report()
            for record in self._limited(fields, counter.grade, at)
        ]
        return [*records, *self._limited(event.fields, event.grade, at)]

    def _limited(self, fields: RecordFields, grade: str, at: Timestamp) -> Iterator[AuditRecord]:
        """Yield the record if the rate limit permits; otherwise count it."""
        bucket = self.buckets.get(grade)
        if bucket is None:
            bucket = self.buckets[grade] = TokenBucket(RECORDS_PER_S[grade], BURST)
        if bucket.take(at.mono_s):
            yield AuditRecord(at, fields, minor=grade == "rejected")
            return
        counter = self.held_back.setdefault(grade, EventCounter("held_back", at, fields))
        counter.fields = fields
        if self.shared_name:
            counter.fields = {**fields, "who": self.shared_name, "last_who": fields.get("who")}
        counter.add(at, fields.get("times", 1))

    def due(self, at: Timestamp) -> Iterator[AuditRecord]:
        for counters in (self.repeated, self.held_back):
            for key, counter in list(counters.items()):
                ended = counter.has_ended(at)
                if ended or counter.is_due(at):
                    yield from (AuditRecord(at, fields) for fields in counter.report())
                if ended:
                    del counters[key]

    def is_new(self, now_s: float) -> bool:
        """Return True if the history equals a new history, so that its removal has no effect."""
        full = all(bucket.is_full(now_s) for bucket in self.buckets.values())
        return full and not self.repeated and not self.held_back


class EventThrottle:
    """Filter that passes new events and counts all other events. Periodic reports state the counts."""

    def __init__(self) -> None:
        self._histories: dict[Peer, _PeerHistory] = {}

    def filter(self, peer: Peer, event: AuditEvent, at: Timestamp) -> list[AuditRecord]:
        """Return the records to write because of an event. The list is empty for a repetition."""
        if peer not in self._histories and len(self._histories) >= MAX_PEERS:
            # Several peers share this history. The same event from two of these peers is not a repetition.
            event = event._replace(subject=(peer, event.subject))
            peer = OTHERS
        history = self._histories.get(peer)
        if history is None:
            history = self._histories[peer] = _PeerHistory(OTHERS[0] if peer == OTHERS else "")
        return history.filter(event, at)

    def due(self, at: Timestamp) -> list[AuditRecord]:
        """Return reports of repetitions that have ended or lasted for an hour. Call this periodically."""
        records = [record for history in self._histories.values() for record in history.due(at)]
        self._histories = {
            peer: history for peer, history in self._histories.items() if not history.is_new(at.mono_s)
        }
        return records

    def flush(self, at: Timestamp) -> list[AuditRecord]:
        """Return reports of all events that were counted but not reported. Call this before the log ends."""
        counters = [
            counter
            for history in self._histories.values()
            for counter in (*history.repeated.values(), *history.held_back.values())
        ]
        return [AuditRecord(at, fields) for counter in counters for fields in counter.report()]
