"""Entries of the local socket and of a recording, and their byte layout.

    length of the body u32 · kind u8 · time f64 [s] · body       (little-endian)

The time is the monotonic clock of the host process. The input entries alone determine all measurements. A
session that is restored from the checkpoint and receives the same inputs gives the same measurements, bit for
bit.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Any, NamedTuple

from pneuforce.errors import PneuforceError

HEAD = struct.Struct("<IBd")
MAX_BODY_BYTES = 4_000_000
MAX_JSON_DEPTH = (
    20  #: a JSON value with more nested levels is rejected, because functions recurse over levels
)


class EntryKind(IntEnum):
    """Kind of an entry. The comment of each kind describes the body of the entry."""

    HEADER = 1  #: JSON: identity and configuration of the instrument
    CHECKPOINT = 2  #: state of the session at the time of the entry
    # Inputs of the session.
    ATTACHED = 8  #: no body; the port was opened
    RECEIVED = 9  #: bytes from the rig
    TICK = 10  #: one byte: the health flags of the instrument, see `broadcaster.py`
    COMMAND = 11  #: no body; the host requested the bytes for the board
    DETACHED = 12  #: no body; the port was closed
    WRITE = 13  #: JSON [channel, address, {quantity: value}]: a write request from a bus
    MASTER_LOST = 14  #: no body; the heartbeat of the CANopen master is missing
    MASTER_RECOVERED = 15  #: no body; the heartbeat of the CANopen master has returned
    SHUTDOWN = 16  #: no body; the host process ends and vents
    # Results of the session.
    SAMPLE = 32  #: one sample, raw and measured; see `sample_record.py`
    EVENT = 33  #: JSON: a record of the event log
    SNAPSHOT = 34  #: JSON: every quantity that a bus can show
    HEALTH = 35  #: JSON: state of the link, the buses, the event log and the recording
    END = 40  #: JSON {"why": sentence}: the instrument ended
    # Messages between the host process and its clients.
    SUBSCRIBE = 64  #: JSON {"want": name of a subscription}: the first entry that a client sends
    REQUEST = 65  #: JSON {"id": number, "address": text, "seen_s": time, "values": {register: value}}
    ANSWER = 66  #: JSON {"id": number, "reject_reason": name, "why": sentence}
    FAILURE = 67  #: text: the reason why a recording stopped
    #: JSON {"kind": "login" or "logout", "address": text, "user": text, "result": name, "times": number}
    LOGIN = 68


INPUTS = frozenset(range(EntryKind.ATTACHED, EntryKind.SHUTDOWN + 1))
_KINDS = frozenset(EntryKind)


class StreamError(PneuforceError, ValueError):
    """Invalid bytes in a stream, or an entry that this version does not support."""


class StreamEntry(NamedTuple):
    """One entry: an input of the instrument, one of its results, or a message of a client."""

    kind: EntryKind
    t_s: float
    body: bytes = b""

    @property
    def json_body(self) -> Any:
        """Return the decoded JSON body. Raises StreamError if the body is not JSON."""
        try:
            return parse_json(self.body)
        except StreamError as error:
            raise StreamError(f"an entry of kind {self.kind.name} is not JSON: {error}") from None


def parse_json(text: str | bytes) -> Any:
    """Return the value of a JSON text. Raises StreamError if the text is not JSON or is nested too deeply."""
    try:
        value = json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise StreamError(str(error)) from None
    level = [value]
    for _ in range(MAX_JSON_DEPTH):
        level = [part for whole in level if isinstance(whole, dict | list) for part in _parts_of(whole)]
    if level:
        raise StreamError(f"more than {MAX_JSON_DEPTH} nested levels")
    return value


def _parts_of(whole: dict[str, Any] | list[Any]) -> Iterable[Any]:
    return whole.values() if isinstance(whole, dict) else whole


def json_entry(kind: EntryKind, t_s: float, value: Mapping[str, Any] | list[Any]) -> StreamEntry:
    """Return an entry whose body is `value` as JSON; see `json_safe`."""
    return StreamEntry(
        kind, t_s, json.dumps(json_safe(value), separators=(",", ":"), allow_nan=False).encode()
    )


def json_safe(value: Any) -> Any:
    """Return `value` with JSON types: NaN and infinities become null, a set becomes a sorted list."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: json_safe(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [json_safe(part) for part in value]
    return sorted(value) if isinstance(value, frozenset) else value


def encode(entry: StreamEntry) -> bytes:
    """Return the bytes of an entry."""
    return HEAD.pack(len(entry.body), entry.kind, entry.t_s) + entry.body


class EntryDecoder:
    """Incremental decoder of entries."""

    def __init__(self, max_body_bytes: int = MAX_BODY_BYTES) -> None:
        self._buffer = bytearray()
        self._max_body_bytes = max_body_bytes

    def feed(self, data: bytes) -> list[StreamEntry]:
        """Return the entries that `data` completes, in order. Raises StreamError if a header is invalid."""
        buffer, at = self._buffer, 0
        buffer += data
        entries: list[StreamEntry] = []
        while len(buffer) - at >= HEAD.size:
            length, kind, t_s = HEAD.unpack_from(buffer, at)
            if kind not in _KINDS or length > self._max_body_bytes:
                raise StreamError(f"the header of an entry is invalid: kind {kind}, {length} bytes")
            end = at + HEAD.size + length
            if len(buffer) < end:
                break
            entries.append(StreamEntry(EntryKind(kind), t_s, bytes(buffer[at + HEAD.size : end])))
            at = end
        del buffer[:at]
        return entries

    @property
    def has_partial_entry(self) -> bool:
        """Return True if the last entry is incomplete."""
        return bool(self._buffer)
