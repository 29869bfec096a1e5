"""Heads of an event log that a Prometheus server has stored, read over its HTTP interface."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterable
from http.client import HTTPException
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode, urlsplit
from urllib.request import urlopen

from pneuforce.errors import ConfigurationError, ConnectionFailed
from pneuforce.instrument.audit.witness import HeadSample
from pneuforce.support.user_part import without_user

METRIC = "pneuforce_event_log_info"
TIMEOUT_S = 60.0
#: The stored samples are read in parts of one week, because the answers for years would be large.
PART_S = 7 * 86_400
MAX_PARTS = 520
CLOCK_DIFFERENCE_S = 3600.0  #: tolerance for a clock of the server that is ahead
_RECORDS, _HEAD = re.compile(r"[1-9][0-9]{0,17}"), re.compile(r"[0-9a-f]{64}")
_MAX_TIME_S = 1e11


def stored_heads(url: str, instance: str | None) -> list[HeadSample]:
    """Return all stored heads of one instrument.

    Raises ConnectionFailed if no server answers. Raises ConfigurationError if the server is not Prometheus,
    has stored no head, or has stored heads of several instruments and `instance` is None.
    """
    if not _is_web_address(url):
        raise ConfigurationError(
            f"--witness {without_user(url)} is invalid: an address of Prometheus begins with http:// or "
            "https:// and has neither user nor password, for example http://127.0.0.1:9090"
        )
    matched = METRIC if instance is None else f"{METRIC}{{instance={json.dumps(instance)}}}"
    parts = [_query(url, "query", query=f"{matched}[{PART_S}s]", time=at) for at in _times(url, matched)]
    series = [one for part in parts for one in part]
    found = sorted({str(one["metric"].get("instance", "")) for one in series})
    if not found:
        whose = "of an instrument" if instance is None else f"of the instrument {instance}"
        raise ConfigurationError(f"{url}: Prometheus has stored no head of the event log {whose}")
    if len(found) > 1:
        raise ConfigurationError(
            f"{url}: Prometheus has stored the event logs of several instruments: name one of them with "
            f"--instance: {', '.join(found)}"
        )
    return [sample for one in series for sample in _samples(url, one)]


def _is_web_address(url: str) -> bool:
    try:
        parts = urlsplit(url)
        is_server = bool(parts.hostname) and parts.username is None and parts.port != 0
        return parts.scheme in ("http", "https") and is_server
    except ValueError:  # brackets or a port that are invalid
        return False


def _times(url: str, matched: str) -> list[float]:
    """Return the end of each week in which Prometheus has stored samples."""
    now_s = time.time() + CLOCK_DIFFERENCE_S
    weeks = _query(
        url,
        "query_range",
        query=f"count(count_over_time({matched}[{PART_S}s]))",
        start=now_s - MAX_PARTS * PART_S,
        end=now_s,
        step=PART_S,
    )
    return [float(t_s) for week in weeks for t_s, _ in week["values"]]


def _query(url: str, kind: str, **parameters: str | float) -> list[dict[str, Any]]:
    """Return the series of the answer to a query."""
    address = f"{url.rstrip('/')}/api/v1/{kind}?{urlencode(parameters)}"
    try:
        with urlopen(address, timeout=TIMEOUT_S) as response:
            answer = json.load(response)
        found = answer["data"]["result"]
        times = [t_s for one in found for t_s, _ in one["values"]]
        if all(isinstance(one["metric"], dict) for one in found) and all(map(_is_time, times)):
            return list(found)
    except HTTPError as error:
        raise ConfigurationError(f"{url}: the query was rejected: HTTP status {error.code}") from None
    except (URLError, OSError) as error:
        reason = getattr(error, "reason", None) or error
        raise ConnectionFailed(f"{url}: Prometheus does not answer: {reason}") from None
    except (HTTPException, ValueError, TypeError, KeyError, RecursionError):
        pass
    raise ConfigurationError(f"{url}: the answer is not an answer of Prometheus")


def _samples(url: str, series: dict[str, Any]) -> Iterable[HeadSample]:
    records, head = (str(series["metric"].get(label, "")) for label in ("records", "head"))
    if not (_RECORDS.fullmatch(records) and _HEAD.fullmatch(head)):
        raise ConfigurationError(f"{url}: the metric {METRIC} has an invalid number of records or head")
    return [HeadSample(float(t_s), int(records), head) for t_s, _ in series["values"]]


def _is_time(t_s: object) -> bool:
    return isinstance(t_s, int | float) and 0 <= t_s <= _MAX_TIME_S
