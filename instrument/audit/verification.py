"""Verification of the hash chain of an event log, up to the first wrong record."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, NamedTuple

from pneuforce.instrument.audit.record import GENESIS, chain_digest
from pneuforce.support.counted import counted


class StoredRecord(NamedTuple):
    """One record as stored in the file. In a manipulated file the values can have any type."""

    number: Any
    body: Any
    digest: Any


class VerifiedChain(NamedTuple):
    """Result of a successful verification."""

    records: int
    first_at: str
    last_at: str
    head: str


class BrokenChainError(Exception):
    """Broken hash chain. The message describes the first wrong record."""


def verify_chain(rows: Iterable[StoredRecord], noted_head: str | None = None) -> VerifiedChain:
    """Verify all records of an event log, from the first on.

    `noted_head` is the head (digest of the last record) at an earlier time. The chain must still contain it.
    Raises BrokenChainError.
    """
    head, number, first, last = GENESIS, 0, b"", b""
    found = noted_head in (None, GENESIS.hex())
    for number, row in enumerate(rows, 1):
        _check(row, number, head)
        head = row.digest
        found = found or head.hex() == noted_head
        first, last = first or row.body, row.body
    if not found:
        raise BrokenChainError(
            f"none of {counted(number, 'record')} has the digest {noted_head}, the head that was noted: "
            "records up to this head were changed or removed"
        )
    return VerifiedChain(number, record_time(first), record_time(last), head.hex())


def record_time(body: bytes) -> str:
    """Return the time `at` of a record, or an empty string if the record has none."""
    try:
        return str(json.loads(body)["at"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return ""


def _check(row: StoredRecord, number: int, previous: bytes) -> None:
    if row.number != number:
        raise BrokenChainError(f"record {number} is missing: record {number - 1} is followed by {row.number}")
    if not isinstance(row.body, bytes) or row.digest != chain_digest(previous, row.body):
        raise BrokenChainError(
            f"record {number} does not match its digest: it was changed or is out of order, "
            "or a record before it was removed"
        )
