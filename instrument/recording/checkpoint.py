"""Checkpoint: the complete state of a session, so that a recording can begin at any time.

A checkpoint is a JSON document with the fields of the session and of all objects in these fields. JSON does
not define NaN and infinities, so they are written as `NaN`, `Infinity` and `-Infinity`. A number is written
with as many digits as are necessary to restore each bit.

Users exchange recordings, so a checkpoint can come from a stranger. The declared types of the fields
determine the restored classes (`state_codec.py`), so a checkpoint cannot execute code.
"""

from __future__ import annotations

import json
from typing import Any

from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.state_codec import codec_of
from pneuforce.instrument.stream.entry import StreamError

#: Largest accepted checkpoint. A checkpoint has about 9 kB, and 180 kB with the largest number of peers.
MAX_BYTES = 500_000
MAX_DIGITS = 30  #: largest number of characters of a number; `repr` writes at most 24
_SESSION = codec_of(Session)


def save_session(session: Session) -> bytes:
    """Return the state of a session without its entry sink."""
    return json.dumps(_SESSION.encode(session), separators=(",", ":"), check_circular=False).encode()


def restore_session(state: bytes) -> Session:
    """Return a session with the saved state. Its entry sink discards all entries.

    Raises StreamError if the state is damaged or contains something that `save_session` does not write.
    """
    try:
        restored: Session = _SESSION.decode(_parse(state))
    except (ValueError, RecursionError) as error:
        raise StreamError(f"the checkpoint of the recording cannot be read: {error}") from None
    return restored


def _parse(state: bytes) -> Any:
    """Return the JSON value of a checkpoint. Raises ValueError or RecursionError."""
    if len(state) > MAX_BYTES:
        raise StreamError(f"it has {len(state)} bytes, and the limit is {MAX_BYTES} bytes")
    return json.loads(state.decode(), object_pairs_hook=_object, parse_int=_integer, parse_float=_float)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) != len(pairs):
        raise StreamError("a field occurs twice")
    return fields


def _integer(text: str) -> int:
    return int(_short(text))


def _float(text: str) -> float:
    return float(_short(text))


def _short(text: str) -> str:
    if len(text) > MAX_DIGITS:
        raise StreamError(f"a number has {len(text)} digits")
    return text
