"""Whether a chain of records is unbroken, and which record is the first that is wrong."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, NamedTuple

from instrument.events.record import GENESIS, seal


class Row(NamedTuple):
    """One record as it lies in the file; of an altered file these may be anything."""

    number: Any
    body: Any
    seal: Any


class Chain(NamedTuple):
    """An unbroken chain."""

    records: int
    first_at: str
    last_at: str
    head: str


class Broken(Exception):
    """The first record that is wrong, in a sentence."""


def verified(rows: Iterable[Row], kept_head: str | None = None) -> Chain:
    """The chain that `rows` are, from the first record on.

    `kept_head` is a head that was written down earlier; the chain must still hold that record. Raises Broken.
    """
    head, number, first, last = GENESIS, 0, b"", b""
    found = kept_head in (None, GENESIS.hex())
    for number, row in enumerate(rows, 1):
        _check(row, number, head)
        head = row.seal
        found = found or head.hex() == kept_head
        first, last = first or row.body, row.body
    if not found:
        raise Broken(
            f"none of the {number} records has the head {kept_head}: "
            "what there was up to it was changed or cut off"
        )
    return Chain(number, moment_of(first), moment_of(last), head.hex())


def moment_of(body: bytes) -> str:
    """When a record was made, as it says itself; empty where it does not."""
    try:
        return str(json.loads(body)["at"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return ""


def _check(row: Row, number: int, previous: bytes) -> None:
    if row.number != number:
        raise Broken(f"record {number} is missing: after {number - 1} comes {row.number}")
    if not isinstance(row.body, bytes) or row.seal != seal(previous, row.body):
        raise Broken(
            f"record {number} is not what was sealed onto record {number - 1}: "
            "it was changed, or is out of order, or one before it was taken out"
        )
