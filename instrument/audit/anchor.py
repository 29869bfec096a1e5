"""Anchors of an event log: lines in the journal that state the number of records and the head at one time.

A person who can write to the file of the log can remove its last records, compute all digests again, or put
an older copy in its place. The anchors show this, unless the same person can also change the journal.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import BinaryIO, NamedTuple

from pneuforce.instrument.audit.verification import BrokenChainError, StoredRecord
from pneuforce.support.counted import counted

MAX_LINE_BYTES = 1_000_000
_PATTERN = re.compile(rb"event log: ([1-9][0-9]{0,17}) records, head ([0-9a-f]{64}) at ([0-9T:.-]{19,26}Z)")


class NotedDigest(NamedTuple):
    """Number of records and the first digits of the digest, which a client has read from the registers."""

    records: int
    digits: str  #: hexadecimal


class Anchor(NamedTuple):
    """State of an event log at one time."""

    records: int  #: number of records
    head: str  #: digest of the last record, in hexadecimal
    at: str  #: UTC time


def format_anchor(anchor: Anchor) -> str:
    """Return the line for the journal."""
    return f"event log: {anchor.records} records, head {anchor.head} at {anchor.at}"


def find_anchors(journal: BinaryIO) -> list[Anchor]:
    """Return the anchors in the text of a journal, in their order. Other lines are skipped."""
    lines = iter(lambda: journal.readline(MAX_LINE_BYTES), b"")
    return [
        Anchor(int(records), head.decode(), at.decode())
        for line in lines
        for records, head, at in _PATTERN.findall(line)
    ]


def collect_heads(
    rows: Iterable[StoredRecord], anchors: Iterable[Anchor | NotedDigest], heads: dict[int, str]
) -> Iterator[StoredRecord]:
    """Yield the rows unchanged. Store in `heads` the digest of each record at which an anchor was made."""
    numbers = {anchor.records for anchor in anchors}
    for row in rows:
        if row.number in numbers and isinstance(row.digest, bytes):
            heads[row.number] = row.digest.hex()
        yield row


def check_noted(noted: Iterable[NotedDigest], logs: Sequence[Mapping[int, str]]) -> None:
    """Check that one of the logs has each noted digest. Raises BrokenChainError for the first missing one."""
    for number, digits in noted:
        if not any(log.get(number, "").startswith(digits) for log in logs):
            raise BrokenChainError(
                f"record {number} had a digest that began with {digits}, but no record has this number and "
                "digest now: later, the log was cut, rewritten, replaced by an older copy or moved away"
            )


def check_anchors(anchors: Sequence[Anchor], logs: Sequence[Mapping[int, str]]) -> None:
    """Check that each anchor is in one of the logs, and that no log became shorter.

    Each log is a mapping of record numbers to digests. The logs are in the order in which they were written.
    Raises BrokenChainError for the first anchor that does not match. The message states how many anchors are
    missing, and whether later ones are in the log, as after the restore of a backup.
    """
    place = (0, 0)
    for number, anchor in enumerate(anchors):
        found = [(n, anchor.records) for n, log in enumerate(logs) if log.get(anchor.records) == anchor.head]
        if not found:
            raise BrokenChainError(
                f"at {anchor.at}, record {anchor.records} was the last record and had the digest "
                f"{anchor.head}, but no record has this number and digest now: after that time the log was "
                "cut, rewritten, replaced by an older copy or moved away. "
                f"{_missing(anchors[number:], logs)}. "
                "Name moved logs with --earlier; after the restore of a backup, see docs/events.md"
            )
        if max(found) < place:
            raise BrokenChainError(
                f"at {anchor.at}, record {anchor.records} was the last record, but the log had more records "
                "before: an older copy was in use, or the lines of the journal are not in their order"
            )
        place = min(candidate for candidate in found if candidate >= place)


def _missing(anchors: Sequence[Anchor], logs: Sequence[Mapping[int, str]]) -> str:
    """Return how many anchors are in none of the logs, and how many anchors after the last of these are."""
    missing = [
        anchor for anchor in anchors if not any(log.get(anchor.records) == anchor.head for log in logs)
    ]
    later = anchors[anchors.index(missing[-1]) + 1 :]
    return f"Not in the log: {_span(missing)}; later and in the log: {_span(later)}"


def _span(anchors: Sequence[Anchor]) -> str:
    if not anchors:
        return "none"
    times = f"from {anchors[0].at} to {anchors[-1].at}" if len(anchors) > 1 else f"of {anchors[0].at}"
    return f"{counted(len(anchors), 'anchor')} {times}"
