"""The route /health: whether the instrument runs and measures, for load balancers and monitors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from pneuforce.registers.advice import STATUS_ADVICE
from pneuforce.web.browser_feed import BrowserFeed
from pneuforce.web.server.http_json import json_response

HEALTH_PATH = "/health"
#: Status bits without which no pressure is measured. The first bit is the most important.
NOT_MEASURING = ("link_lost", "sensor_fault", "stale")


def health_routes(feed: BrowserFeed) -> list[Route]:
    """Return the route. It needs no login, and its answer contains no measured value."""

    async def health(_request: Request) -> Response:
        problem = problem_of(feed.snapshot, feed.down_reason)
        return json_response({"ok": not problem, "problem": problem}, 503 if problem else 200)

    return [Route(HEALTH_PATH, health)]


def problem_of(snapshot: Mapping[str, Any] | None, down_reason: str) -> str:
    """Return why the instrument does not measure, empty if it measures.

    `down_reason` is why there is no snapshot.
    """
    if snapshot is None:
        return down_reason
    return next((STATUS_ADVICE[bit].what for bit in NOT_MEASURING if bit in snapshot["status"]), "")
