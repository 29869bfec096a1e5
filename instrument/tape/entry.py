"""Entries of the tape, and how they lie on the local socket.

    length of the body u32 · kind u8 · time f64 [s] · body       (little-endian)

The time is the host's monotonic clock. The inputs alone determine everything else: whoever starts from the
checkpoint and feeds them in order into a coupling has the same measurements, bit for bit.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from enum import IntEnum
from typing import Any, NamedTuple

from instrument.errors import PneuforceError

HEAD = struct.Struct("<IBd")
LONGEST_BODY = 4_000_000


class Kind(IntEnum):
    """What an entry tells, and what its body is."""

    BEGIN = 1  #: JSON: what instrument this is, and its configuration
    CHECKPOINT = 2  #: state of the coupling at that moment
    # inputs
    ATTACHED = 8  #: the port was opened
    RECEIVED = 9  #: bytes from the rig
    BEAT = 10  #: time has passed; one byte: which of the neighbours are in trouble, see `feed.py`
    ASKED = 11  #: the board was told what is wanted of it
    DETACHED = 12  #: the port is gone
    WRITE = 13  #: JSON [channel, address, {quantity: value}]: a request of a bus
    MASTER_LOST = 14
    MASTER_BACK = 15
    LEAVING = 16  #: the host ends, and vents
    # what came of them
    MEASURED = 32  #: one sample, raw and derived
    EVENT = 33  #: JSON: a record of the event log
    SNAPSHOT = 34  #: JSON: every quantity that a bus may show
    HEALTH = 35  #: JSON: link, buses, log and recording
    END = 40  #: JSON: the instrument ended in good order
    # between the host and who listens
    WANT = 64  #: JSON {"want": "record" or "page"}: the first that a listener says
    REQUEST = 65  #: JSON {"id": number, "values": {register: value}}
    ANSWER = 66  #: JSON {"id": number, "refusal": name, "why": sentence}
    TROUBLE = 67  #: text: why a recording stopped


INPUTS = frozenset(range(Kind.ATTACHED, Kind.LEAVING + 1))
_KINDS = frozenset(Kind)


class TapeError(PneuforceError, ValueError):
    """Bytes that are no entries, or entries that no instrument of this version puts down."""


class Entry(NamedTuple):
    """One thing that happened."""

    kind: Kind
    t_s: float
    body: bytes = b""

    @property
    def facts(self) -> Any:
        """The body, where it is JSON. Raises TapeError where it is not."""
        try:
            return json.loads(self.body)
        except ValueError as error:
            raise TapeError(f"an entry of kind {self.kind.name} is not JSON: {error}") from None


def told(kind: Kind, t_s: float, facts: Mapping[str, Any] | list[Any]) -> Entry:
    """An entry whose body is JSON; see `plain`."""
    return Entry(kind, t_s, json.dumps(plain(facts), separators=(",", ":"), allow_nan=False).encode())


def plain(value: Any) -> Any:
    """What JSON knows of a value: null for a number that is none, a sorted list for a set."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    return sorted(value) if isinstance(value, frozenset) else value


def encode(entry: Entry) -> bytes:
    """The bytes of an entry."""
    return HEAD.pack(len(entry.body), entry.kind, entry.t_s) + entry.body


class Decoder:
    """Bytes in, entries out."""

    def __init__(self, longest_body: int = LONGEST_BODY) -> None:
        self._buffer = bytearray()
        self._longest_body = longest_body

    def feed(self, data: bytes) -> list[Entry]:
        """Entries completed by `data`, in order. Raises TapeError where these are no entries."""
        buffer, at = self._buffer, 0
        buffer += data
        entries: list[Entry] = []
        while len(buffer) - at >= HEAD.size:
            length, kind, t_s = HEAD.unpack_from(buffer, at)
            if kind not in _KINDS or length > self._longest_body:
                raise TapeError(f"no entry of the tape: kind {kind}, {length} bytes")
            end = at + HEAD.size + length
            if len(buffer) < end:
                break
            entries.append(Entry(Kind(kind), t_s, bytes(buffer[at + HEAD.size : end])))
            at = end
        del buffer[:at]
        return entries

    @property
    def unfinished(self) -> bool:
        """Whether an entry has begun and is not whole."""
        return bool(self._buffer)
