"""Small HTML pages that answer a browser in which scripts are disabled. Programs get JSON."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from http import HTTPStatus
from typing import Any

from starlette.responses import Response

from pneuforce.web.server.http_json import VENT_PATH, error_response

VENT_STATE_PATH = "/vent-state"
REFRESH_S = 2
STOP_SWITCH = "Press the stop switch at the rig."
NOT_VENTED, NOT_VERIFIED = "NOT VENTED", "NOT VERIFIED"
_VENT_FAULT = f"The balloon may be inflated: do not pull it out. {STOP_SWITCH}"
_VENTED = "The sensor reads no pressure. Look at the balloon."
_UNPROVEN_TUBE = (
    "The tube was blocked: the balloon may be inflated although the sensor reads no pressure. "
    f"Look at the balloon, and do not pull it out while it is inflated. {STOP_SWITCH}"
)
_VENTING = (
    "The balloon is not yet verified as empty. "
    "If this lasts longer than 10 s, press the stop switch at the rig."
)

_PAGE = """<!doctype html>
<html lang="en">
<head>
  <meta charset="utf-8">
  <meta name="viewport" content="width=device-width, initial-scale=1">
  <title>{title} · pneuforce</title>
  <link rel="stylesheet" href="/static/colours.css">
  <link rel="stylesheet" href="/static/layout.css">
</head>
<body class="plain">
  <h1{mark}>{title}</h1>
  <p>{text}</p>
  <p><a href="/">Back to the page of the instrument</a></p>
</body>
</html>
"""


def wants_page(headers: Mapping[str, str]) -> bool:
    """Return True if a browser opens the answer as a page. Scripts and programs accept any type."""
    return "text/html" in headers.get("accept", "")


def plain_page(title: str, text: str, status: int = 200, refresh_s: int | None = None) -> Response:
    """Return a page with a title and one paragraph. After `refresh_s`, the browser shows the vent state."""
    headers = {} if refresh_s is None else {"Refresh": f"{refresh_s}; url={VENT_STATE_PATH}"}
    mark = ' class="alarm"' if title in (NOT_VENTED, NOT_VERIFIED) else ""
    page = _PAGE.format(title=escape(title), mark=mark, text=escape(text))
    return Response(page, status, headers, "text/html")


def error_answer(path: str, headers: Mapping[str, str], status: int, text: str) -> Response:
    """Return the answer to a failed request for `path`: a page, or JSON for a program."""
    if not wants_page(headers):
        return error_response(status, text)
    return plain_page(NOT_VENTED if path == VENT_PATH else HTTPStatus(status).phrase, text, status)


def vent_accepted_page(is_replay: bool, snapshot: Mapping[str, Any] | None) -> Response:
    """Return the answer to an accepted vent. The browser then follows the state of the vent.

    `snapshot` contains the values before the vent, if they are known. If a vent fault is latched, the page
    says so at once.
    """
    if is_replay:
        return plain_page("Vent accepted", "A replay has no balloon to vent.")
    if snapshot and "vent_fault" in snapshot["status"]:
        return vent_state_page(snapshot, "")
    return plain_page("Vent accepted", _VENTING, refresh_s=REFRESH_S)


def vent_state_page(snapshot: Mapping[str, Any] | None, down_reason: str) -> Response:
    """Return the state of the vent. The page refreshes itself until the balloon is verified as empty.

    After a blocked tube, the pressure at the sensor verifies no vent, until a proof test has passed.
    """
    if snapshot is None:
        text = f"{down_reason} Whether the balloon is empty is unknown. {STOP_SWITCH}"
        return plain_page("No values", text, refresh_s=REFRESH_S)
    if "vent_fault" in snapshot["status"]:
        return plain_page(NOT_VENTED, _VENT_FAULT, refresh_s=REFRESH_S)
    if "vented" in snapshot["status"]:
        if "tube_unproven" in (snapshot.get("maintenance_causes") or ()):
            return plain_page(NOT_VERIFIED, _UNPROVEN_TUBE, refresh_s=REFRESH_S)
        return plain_page("Vented", _VENTED)
    return plain_page(f"Not vented yet: {snapshot['state']}", _VENTING, refresh_s=REFRESH_S)
