"""Records of the event log from before the connection to the instrument, for the list of events."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from pneuforce.errors import PneuforceError
from pneuforce.instrument.audit.reading import DamagedLogError, latest_records
from pneuforce.instrument.audit.verification import StoredRecord
from pneuforce.web.browser_feed import MAX_EVENTS, BrowserFeed
from pneuforce.web.event_texts import event_message

#: Time from the header of the stream to the reading of the log. The instrument writes each record within
#: 0.1 s, so that every record is in the log or in the stream.
DELAY_S = 0.5

log = logging.getLogger("pneuforce")


class EarlierEvents:
    """Reader of the event log, which reads the latest records after each connection to the instrument.

    `path` is the event log; None: the instrument has no event log.
    """

    def __init__(self, path: Path | None, feed: BrowserFeed) -> None:
        self._path = path
        self._feed = feed

    async def run(self) -> None:
        """Add the latest records of the log to the feed after each header, until cancelled.

        A thread reads the log, so that a slow disk does not delay the measured values.
        """
        last: Mapping[str, Any] = {}
        while self._path:
            await asyncio.sleep(DELAY_S)
            header = self._feed.header
            if header and header is not last:
                last = header
                await asyncio.sleep(DELAY_S)
                self._feed.add_earlier_events(await asyncio.to_thread(earlier_events, self._path))


def earlier_events(path: Path) -> list[dict[str, str]]:
    """Return the latest records of an event log for the browsers, the oldest first.

    If the log cannot be read, return an empty list and log a warning.
    """
    try:
        return _messages(latest_records(path, MAX_EVENTS))
    except (PneuforceError, DamagedLogError, OSError) as error:
        log.warning("the web page shows no events from before its start: %s", error)
        return []


def _messages(records: Iterable[StoredRecord]) -> list[dict[str, str]]:
    """Return the records in words, without damaged records: `pneuforce log verify` finds these."""
    messages = []
    for record in records:
        with suppress(ValueError, TypeError, AttributeError, RecursionError):
            messages.append(event_message(json.loads(record.body)))
    return messages
