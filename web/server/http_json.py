"""JSON of the web API: responses, and validation of request bodies."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from textwrap import shorten
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from pneuforce.registers.write_request import MalformedWriteRequest, parse_write_request

MAX_BODY_BYTES = 16_384
BODY_TIMEOUT_S = 5.0
MAX_QUOTED_CHARACTERS = 200  #: limit for a validation error, which may quote the request
MAX_TIME_S = 1e12  #: upper bound of a valid time; infinity and NaN fail the comparison
VENT = {"mode": "vent"}
VENT_PATH = "/api/vent"


class HttpRequestError(Exception):
    """Invalid request, with the HTTP status of the response. The message is one sentence for the operator."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


def to_json(value: Any) -> str:
    """Return compact JSON. Raises ValueError if a number is NaN or infinite."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def json_response(value: Any, status: int = 200) -> Response:
    """Return a response with a JSON body."""
    return Response(to_json(value), status, media_type="application/json")


def error_response(status: int, text: str) -> Response:
    """Return a response with the body {"text": text}, which the web page shows to the operator."""
    return json_response({"text": text}, status)


async def read_json_object(request: Request) -> dict[str, Any]:
    """Return the JSON object in the body of a request.

    Raises HttpRequestError if the body is incomplete after `BODY_TIMEOUT_S`, longer than `MAX_BODY_BYTES`, or
    not a JSON object.
    """
    try:
        async with asyncio.timeout(BODY_TIMEOUT_S):
            body = await _read_body(request)
    except TimeoutError:
        raise HttpRequestError(408, f"The request was incomplete after {BODY_TIMEOUT_S:g} s.") from None
    except ClientDisconnect:
        raise HttpRequestError(400, "The request is incomplete: the connection was closed.") from None
    try:
        value = json.loads(body, parse_constant=_reject_constant)
    except (ValueError, RecursionError):
        raise HttpRequestError(400, "The request is not valid JSON.") from None
    if not isinstance(value, dict):
        raise HttpRequestError(400, "The request is not a JSON object.")
    return value


async def _read_body(request: Request) -> bytes:
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > MAX_BODY_BYTES:
            raise HttpRequestError(413, f"The request is longer than {MAX_BODY_BYTES} bytes.")
    return bytes(body)


def _reject_constant(text: str) -> None:
    """Raise ValueError for NaN and Infinity, which Python's parser accepts and JSON does not allow."""
    raise ValueError(f"{text} is not a JSON number")


def parse_values(body: Mapping[str, Any]) -> dict[str, Any]:
    """Return the registers and values of a write request. Raises HttpRequestError if they are invalid."""
    values = body.get("values")
    if not isinstance(values, dict):
        raise HttpRequestError(
            400, 'The request has no "values". Name each register, for example {"values": {"mode": "vent"}}.'
        )
    try:
        parse_write_request(values)
    except MalformedWriteRequest as error:
        reason = shorten(str(error), MAX_QUOTED_CHARACTERS)
        raise HttpRequestError(400, f"The write request is invalid: {reason}.") from None
    except OverflowError:
        raise HttpRequestError(400, "The write request is invalid: a number has too many digits.") from None
    return values


def parse_seen_s(body: Mapping[str, Any]) -> float | None:
    """Return the time [s] of the state on which the operator based the request, or None for a vent.

    A vent needs no time, because a vent is never too late. Raises HttpRequestError if the time is missing or
    not a finite number.
    """
    seen_s = body.get("seen_s")
    if body.get("values") == VENT:
        return None
    if isinstance(seen_s, int | float) and not isinstance(seen_s, bool) and abs(seen_s) < MAX_TIME_S:
        return seen_s
    raise HttpRequestError(
        400, 'The time "seen_s" is missing or invalid. Send the "t_s" of the state that was shown.'
    )
