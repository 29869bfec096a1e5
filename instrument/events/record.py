"""A record: what happened and when, in one canonical form, sealed onto the record before it."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any, NamedTuple

GENESIS = bytes(32)  #: what the first record is sealed onto

Facts = Mapping[str, Any]


class Moment(NamedTuple):
    """One instant, on the wall and on the clock that never jumps."""

    utc_us: int  #: microseconds since 1970
    mono_s: float


class Record(NamedTuple):
    """What is to be kept. `minor` is what may be lost first."""

    at: Moment
    facts: Facts
    minor: bool = False


def body_of(record: Record) -> bytes:
    """Canonical JSON of a record: sorted keys, no spaces, ASCII, numbers that are none as text."""
    timed = {"at": written(record.at), "mono_s": round(record.at.mono_s, 6), **record.facts}
    return json.dumps(_plain(timed), sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def written(at: Moment) -> str:
    """UTC as ISO 8601, to the microsecond."""
    second_s, us = divmod(at.utc_us, 1_000_000)
    return f"{datetime.fromtimestamp(second_s, UTC):%Y-%m-%dT%H:%M:%S}.{us:06d}Z"


def seal(previous: bytes, body: bytes) -> bytes:
    """SHA-256 of the seal before and the body: who changes one record breaks all that follow."""
    return hashlib.sha256(previous + body).digest()


def _plain(value: Any) -> Any:
    """What JSON knows: NaN and the infinities become text."""
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return value if value is None or isinstance(value, bool | int) else str(value)
