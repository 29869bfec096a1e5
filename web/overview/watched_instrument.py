"""State of one instrument, received from its local socket. Nothing is ever sent except the subscription."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pneuforce.instrument.stream.entry import (
    EntryDecoder,
    EntryKind,
    StreamEntry,
    StreamError,
    encode,
    json_entry,
)

RECONNECT_S = 1.0
SILENCE_S = 1.0  #: without a snapshot for this time, the values are invalid
READ_BYTES = 65_536


@dataclass(slots=True)
class WatchedInstrument:
    """Latest state of one instrument."""

    name: str
    socket: Path
    web_port: int | None = None  #: port of its own page; None without one
    web_scheme: str = "http"  #: https if its own page has a certificate
    header: Mapping[str, Any] = field(default_factory=dict)
    reason: str = "not reached yet"  #: why there is no state
    _snapshot: Mapping[str, Any] = field(default_factory=dict)
    _snapshot_s: float = float("-inf")

    def state(self, now_s: float) -> Mapping[str, Any] | None:
        """Return the latest snapshot, or None if it is older than SILENCE_S."""
        return self._snapshot if now_s - self._snapshot_s <= SILENCE_S else None

    async def run(self) -> None:
        """Receive until cancelled. Connect again after each failure."""
        while True:
            try:
                await self._receive()
                self.reason = "the instrument has closed the connection"
            except (StreamError, struct.error, ValueError) as error:
                self.reason = f"the instrument has another version ({error}): update or restart it"
            except OSError as error:
                self.reason = f"the instrument is not running: {self.socket}: {error.strerror or error}"
            await asyncio.sleep(RECONNECT_S)

    async def _receive(self) -> None:
        reader, writer = await asyncio.open_unix_connection(self.socket)
        try:
            writer.write(encode(json_entry(EntryKind.SUBSCRIBE, time.monotonic(), {"want": "overview"})))
            decoder = EntryDecoder()
            while data := await reader.read(READ_BYTES):
                for entry in decoder.feed(data):
                    self.process(entry, time.monotonic())
        finally:
            writer.transport.abort()

    def process(self, entry: StreamEntry, now_s: float) -> None:
        """Keep the content of an entry."""
        if entry.kind is EntryKind.HEADER:
            self.header = entry.json_body
        elif entry.kind is EntryKind.SNAPSHOT:
            self._snapshot, self._snapshot_s = entry.json_body, now_s
            self.reason = "the instrument sends nothing"
