"""The feed: the tape as it comes, for those who listen now."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from instrument.measurement import Measurement
from instrument.rig.link import RawSample
from instrument.tape.entry import INPUTS, Entry, Kind, encode, told
from instrument.tape.measured import pack

if TYPE_CHECKING:
    from instrument.core import Instrument

MOST_BACKLOG = 8_000_000  #: bytes that a listener may be behind: a minute and a half of samples

_OUTCOME = frozenset((Kind.BEGIN, Kind.MEASURED, Kind.EVENT, Kind.END, Kind.ANSWER))
#: What each kind of listener gets.
WANTS: Mapping[str, frozenset[int]] = {
    "record": _OUTCOME | INPUTS | {Kind.CHECKPOINT},
    "page": _OUTCOME | {Kind.SNAPSHOT, Kind.HEALTH},
}
#: What in the neighbourhood is in trouble, as the instrument knows it: the bits of a BEAT's byte.
TROUBLES = ("can_down", "log_down", "recording_down")


class Listener:
    """Entries that wait to be taken."""

    def __init__(self, wants: str) -> None:
        """Raises KeyError: nobody may want that."""
        self.wants = wants
        self.kinds = WANTS[wants]
        self.behind = 0  #: bytes
        self._waiting: list[bytes] = []

    def put(self, kind: Kind, data: bytes) -> None:
        """Keep an entry, if it is wanted."""
        if kind in self.kinds and self.behind <= MOST_BACKLOG:
            self._waiting.append(data)
            self.behind += len(data)

    def take(self) -> bytes:
        """All that waits."""
        data = b"".join(self._waiting)
        self._waiting.clear()
        self.behind = 0
        return data


class Feed:
    """A tape that is given to its listeners, and costs nothing without."""

    def __init__(self, offers: Collection[str] = WANTS.keys()) -> None:
        self.offers = offers  #: what may be wanted of it
        self.listeners: list[Listener] = []

    def note(self, kind: Kind, t_s: float, body: bytes = b"") -> None:
        """Give one entry to those who want it."""
        if self.listeners:
            self.give(Entry(kind, t_s, body))

    def note_beat(self, instrument: Instrument, t_s: float) -> None:
        """Give a beat, with the troubles that the instrument knows of."""
        if self.listeners:
            self.give(Entry(Kind.BEAT, t_s, bytes((troubles_of(instrument),))))

    def note_measured(self, raw: RawSample, measurement: Measurement, t_s: float) -> None:
        """Give a sample and what became of it."""
        if self.listeners:
            self.give(Entry(Kind.MEASURED, t_s, pack(raw, measurement)))

    def tell(self, kind: Kind, t_s: float, facts: Mapping[str, Any] | list[Any]) -> None:
        """Give an entry whose body is JSON."""
        if any(kind in listener.kinds for listener in self.listeners):
            self.give(told(kind, t_s, facts))

    def give(self, entry: Entry) -> None:
        """Give an entry to those who want it."""
        data = encode(entry)
        for listener in self.listeners:
            listener.put(entry.kind, data)


def troubles_of(instrument: Instrument) -> int:
    """Mask of the neighbours' troubles."""
    return sum(getattr(instrument, name) << bit for bit, name in enumerate(TROUBLES))


def set_troubles(instrument: Instrument, mask: int) -> None:
    """Tell the instrument of its neighbours' troubles, as a beat was recorded with them."""
    for bit, name in enumerate(TROUBLES):
        setattr(instrument, name, bool(mask >> bit & 1))
