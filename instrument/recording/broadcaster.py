"""Distribution of the entries of a running instrument to its subscribers."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.rig.link import RawSample
from pneuforce.instrument.stream.entry import INPUTS, EntryKind, StreamEntry, encode, json_entry
from pneuforce.instrument.stream.sample_record import pack

if TYPE_CHECKING:
    from pneuforce.instrument.core.controller import Instrument

MAX_BACKLOG_BYTES = 8_000_000  #: limit of the unsent bytes of a subscriber; corresponds to 90 s of samples

_RESULTS = frozenset((EntryKind.HEADER, EntryKind.SAMPLE, EntryKind.EVENT, EntryKind.END, EntryKind.ANSWER))
#: Kinds of entry that each subscription receives.
SUBSCRIPTIONS: Mapping[str, frozenset[int]] = {
    "record": _RESULTS | INPUTS | {EntryKind.CHECKPOINT},
    "web": _RESULTS | {EntryKind.WRITE, EntryKind.SNAPSHOT, EntryKind.HEALTH},
    "mqtt": frozenset((EntryKind.HEADER, EntryKind.SNAPSHOT, EntryKind.END)),
    "overview": frozenset((EntryKind.HEADER, EntryKind.SNAPSHOT, EntryKind.END)),
}
#: Attributes of the instrument that are the bits of the byte in a TICK entry, from bit 0 upwards.
HEALTH_FLAGS = ("can_down", "log_down", "recording_down", "certificate_expiring")


class Subscriber:
    """Queue of encoded entries for one client."""

    def __init__(self, subscription: str) -> None:
        """Create an empty queue. Raises KeyError if `subscription` is not a key of SUBSCRIPTIONS."""
        self.subscription = subscription
        self.kinds = SUBSCRIPTIONS[subscription]
        self.backlog_bytes = 0
        self._queue: list[bytes] = []

    def append(self, kind: EntryKind, data: bytes) -> None:
        """Queue an encoded entry. Drop it if its kind is not subscribed or the backlog is too large."""
        if kind in self.kinds and self.backlog_bytes <= MAX_BACKLOG_BYTES:
            self._queue.append(data)
            self.backlog_bytes += len(data)

    def take_all(self) -> bytes:
        """Return all queued bytes and empty the queue."""
        data = b"".join(self._queue)
        self._queue.clear()
        self.backlog_bytes = 0
        return data


class EntryBroadcaster:
    """Entry sink that passes each entry to all subscribers. Without subscribers, no entry is encoded."""

    def __init__(self, offered: Collection[str] = SUBSCRIPTIONS.keys()) -> None:
        self.offered = offered  #: subscriptions that a client may choose
        self.subscribers: list[Subscriber] = []

    def record(self, kind: EntryKind, t_s: float, body: bytes = b"") -> None:
        """Publish one entry."""
        if self.subscribers:
            self.publish(StreamEntry(kind, t_s, body))

    def record_tick(self, instrument: Instrument, t_s: float) -> None:
        """Publish a tick with the health flags of the instrument."""
        if self.subscribers:
            self.publish(StreamEntry(EntryKind.TICK, t_s, bytes((health_flags_of(instrument),))))

    def record_measurement(self, raw: RawSample, measurement: Measurement, t_s: float) -> None:
        """Publish a sample with its measurement."""
        if self.subscribers:
            self.publish(StreamEntry(EntryKind.SAMPLE, t_s, pack(raw, measurement)))

    def publish_json(self, kind: EntryKind, t_s: float, value: Mapping[str, Any] | list[Any]) -> None:
        """Publish an entry whose body is `value` as JSON."""
        if any(kind in subscriber.kinds for subscriber in self.subscribers):
            self.publish(json_entry(kind, t_s, value))

    def publish(self, entry: StreamEntry) -> None:
        """Queue an entry for each subscriber that receives this kind of entry."""
        data = encode(entry)
        for subscriber in self.subscribers:
            subscriber.append(entry.kind, data)


def health_flags_of(instrument: Instrument) -> int:
    """Return the health flags of the instrument as a bit mask; see HEALTH_FLAGS."""
    return sum(getattr(instrument, name) << bit for bit, name in enumerate(HEALTH_FLAGS))


def set_health_flags(instrument: Instrument, mask: int) -> None:
    """Set the health flags of the instrument from the bit mask of a recorded tick."""
    for bit, name in enumerate(HEALTH_FLAGS):
        setattr(instrument, name, bool(mask >> bit & 1))
