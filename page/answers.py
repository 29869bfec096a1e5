"""Answers to a browser, and what is believed of its questions."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from textwrap import shorten
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from registers.asked import Malformed
from registers.asked import asked as check

MOST_BYTES = 16_384
BODY_S = 5.0
MOST_ECHOED = 200
NO_TIME_S = 1e12
VENT = {"mode": "vent"}


class Refused(Exception):
    """A question that cannot be answered: its HTTP status, and why in a sentence."""

    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.status = status


def text_of(facts: Any) -> str:
    """JSON of facts in which no number is NaN."""
    return json.dumps(facts, separators=(",", ":"), allow_nan=False)


def answer(facts: Any, status: int = 200) -> Response:
    """An answer of JSON."""
    return Response(text_of(facts), status, media_type="application/json")


def told(status: int, why: str) -> Response:
    """An answer that says why there is no other."""
    return answer({"text": why}, status)


async def asked(request: Request) -> dict[str, Any]:
    """The JSON object that a request brings. Raises Refused."""
    try:
        async with asyncio.timeout(BODY_S):
            body = await _body(request)
    except TimeoutError:
        raise Refused(408, f"The request did not come whole within {BODY_S:g} s.") from None
    except ClientDisconnect:
        raise Refused(400, "The request did not come whole.") from None
    try:
        facts = json.loads(body, parse_constant=_no_number)
    except (ValueError, RecursionError):
        raise Refused(400, "The request is not JSON.") from None
    if not isinstance(facts, dict):
        raise Refused(400, "The request is not a JSON object.")
    return facts


async def _body(request: Request) -> bytes:
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > MOST_BYTES:
            raise Refused(413, f"The request is longer than {MOST_BYTES} bytes.")
    return bytes(body)


def _no_number(text: str) -> None:
    raise ValueError(f"{text} is no number of JSON")


def wanted(facts: Mapping[str, Any]) -> dict[str, Any]:
    """The registers and values that a request to write names. Raises Refused."""
    values = facts.get("values")
    if not isinstance(values, dict):
        raise Refused(400, 'The request names no values: {"values": {"mode": "vent"}} would.')
    try:
        check(values)
    except Malformed as error:
        raise Refused(400, f"That cannot be asked: {shorten(str(error), MOST_ECHOED)}.") from None
    except OverflowError:
        raise Refused(400, "That cannot be asked: a number is too long.") from None
    return values


def seen(facts: Mapping[str, Any]) -> float | None:
    """The time of the state that a request was decided upon; a vent may do without. Raises Refused."""
    seen_s = facts.get("seen_s")
    if facts.get("values") == VENT:
        return None
    if isinstance(seen_s, int | float) and not isinstance(seen_s, bool) and abs(seen_s) < NO_TIME_S:
        return seen_s
    raise Refused(400, 'The request does not say what it was decided upon: "seen_s", the "t_s" of a state.')
