"""Record of the event log, its canonical form and its digest."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any, NamedTuple

GENESIS = bytes(32)  #: previous digest of the first record

RecordFields = Mapping[str, Any]


class Timestamp(NamedTuple):
    """One instant on the wall clock and on the monotonic clock."""

    utc_us: int  #: UTC, in microseconds since 1970-01-01
    mono_s: float


class AuditRecord(NamedTuple):
    """One record of the event log. If the disk is not available, records with `minor` are dropped first."""

    at: Timestamp
    fields: RecordFields
    minor: bool = False


def record_body(record: AuditRecord) -> bytes:
    """Return the canonical JSON of a record: sorted keys, no spaces, ASCII, NaN and infinities as text."""
    body = {"at": iso_utc(record.at), "mono_s": round(record.at.mono_s, 6), **record.fields}
    return json.dumps(_json_value(body), sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def iso_utc(at: Timestamp) -> str:
    """Return the UTC time of a timestamp in ISO 8601 format, with microseconds."""
    second_s, us = divmod(at.utc_us, 1_000_000)
    return f"{datetime.fromtimestamp(second_s, UTC):%Y-%m-%dT%H:%M:%S}.{us:06d}Z"


def chain_digest(previous: bytes, body: bytes) -> bytes:
    """Return the SHA-256 of the previous digest and the body.

    If a record is changed, its digest and all later digests are wrong.
    """
    return hashlib.sha256(previous + body).digest()


def _json_value(value: Any) -> Any:
    """Return `value` converted to JSON types. NaN and infinities become text."""
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return {str(key): _json_value(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_json_value(part) for part in value]
    return value if value is None or isinstance(value, bool | int) else str(value)
