"""Client of the local socket of the instrument: receives the stream, and sends write requests."""

from __future__ import annotations

import asyncio
import math
import struct
import time
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import Any

from pneuforce.errors import PneuforceError
from pneuforce.instrument.stream.entry import (
    EntryDecoder,
    EntryKind,
    StreamEntry,
    StreamError,
    encode,
    json_entry,
)
from pneuforce.support.backoff import Backoff
from pneuforce.web.browser_feed import BrowserFeed
from pneuforce.web.login.login_events import LoginEvents
from pneuforce.web.server.http_json import VENT

RECONNECT_FIRST_S = 0.1
RECONNECT_MAX_S = 3.0
ANSWER_TIMEOUT_S = 1.0
READ_BYTES = 65_536
MAX_UNSENT_BYTES = 65_536  #: limit for the size of requests that the instrument has not read
#: Vents that wait for an answer of the instrument at the same time. The instrument disconnects a web process
#: that sends too many requests at once.
MAX_PENDING_VENTS = 8


class InstrumentUnavailable(PneuforceError, TimeoutError):
    """Error for an unanswered write request. The instrument may have received the request."""


class InstrumentClient:
    """Connection to the instrument, which is opened again after each failure."""

    def __init__(self, socket: Path, feed: BrowserFeed) -> None:
        self._socket = socket
        self._feed = feed
        self._writer: asyncio.StreamWriter | None = None
        self._request_ids = count(1)
        self._pending: dict[int, asyncio.Future[Mapping[str, Any]]] = {}
        self._waiting_vents: dict[str, asyncio.Task[Mapping[str, Any]]] = {}
        self._vent_slots = asyncio.Semaphore(MAX_PENDING_VENTS)
        self._backoff = Backoff(RECONNECT_FIRST_S, RECONNECT_MAX_S, stable_s=math.inf)

    async def run(self) -> None:
        """Receive entries until cancelled, and connect again after each failure."""
        while True:
            try:
                await self._receive()
                self._disconnected("The instrument has closed the connection.")
            except (StreamError, struct.error) as error:
                self._disconnected(
                    f"The instrument and this web page have different versions ({error}). Restart pneuforce."
                )
            except OSError as error:
                self._disconnected(
                    f"The instrument is not running: {self._socket}: {error.strerror or error}."
                )
            await asyncio.sleep(self._backoff.wait_s)
            self._backoff.attempted()

    async def _receive(self) -> None:
        reader, writer = await asyncio.open_unix_connection(self._socket)
        try:
            writer.write(encode(json_entry(EntryKind.SUBSCRIBE, time.monotonic(), {"want": "web"})))
            self._writer = writer
            decoder = EntryDecoder()
            while data := await reader.read(READ_BYTES):
                for entry in decoder.feed(data):
                    self._process(entry)
        finally:
            self._writer = None
            writer.transport.abort()

    def _process(self, entry: StreamEntry) -> None:
        if entry.kind is EntryKind.ANSWER:
            self._on_answer({**entry.json_body, "t_s": entry.t_s})
            return
        self._feed.process(entry)
        self._backoff.reset()

    def _on_answer(self, answer: Mapping[str, Any]) -> None:
        pending = self._pending.get(answer.get("id", 0))
        if pending is not None and not pending.done():
            pending.set_result(answer)

    def _disconnected(self, reason: str) -> None:
        self._feed.disconnected(reason)
        for pending in self._pending.values():
            if not pending.done():
                pending.set_exception(InstrumentUnavailable(reason))

    def report(self, events: LoginEvents) -> None:
        """Report login events to the instrument. If the instrument is not connected, report them later."""
        writer = self._writer
        if writer is None or writer.transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
            return
        for event in events.take():
            writer.write(encode(json_entry(EntryKind.LOGIN, time.monotonic(), event)))

    async def vent(self, address: str) -> Mapping[str, Any]:
        """Send a vent from a client and return the answer of the instrument, with its time `t_s`.

        `address` is the address of the client, after `name@` if a user is logged in. Vents from one address
        that have not been sent yet are sent as one request. A flood of vents therefore cannot exceed the rate
        at which the instrument answers. Each vent is sent after its arrival.

        Raises InstrumentUnavailable, as `write` does.
        """
        waiting = self._waiting_vents.get(address)
        if waiting is None:
            waiting = asyncio.create_task(self._send_vent(address))
            self._waiting_vents[address] = waiting
        return await asyncio.shield(waiting)

    async def _send_vent(self, address: str) -> Mapping[str, Any]:
        async with self._vent_slots:
            del self._waiting_vents[address]  # a vent that arrives from now on needs a new request
            return await self.write(VENT, address)

    async def write(
        self, values: Mapping[str, Any], address: str, seen_s: float | None = None
    ) -> Mapping[str, Any]:
        """Send a write request from a client and return the answer of the instrument.

        `address` is as for `vent`. `values` maps register names to new values. `seen_s` is the time [s] of
        the state on which the operator based the request; None for a vent. The instrument rejects a request
        whose `seen_s` is too old.

        Raises InstrumentUnavailable if the instrument is not connected, does not read requests, or does not
        answer within `ANSWER_TIMEOUT_S`.
        """
        if self._writer is None:
            raise InstrumentUnavailable(self._feed.down_reason)
        if self._writer.transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
            raise InstrumentUnavailable("The instrument does not read requests.")
        request_id = next(self._request_ids)
        pending = self._pending[request_id] = asyncio.get_running_loop().create_future()
        try:
            request = {"id": request_id, "address": address, "values": values, "seen_s": seen_s}
            self._writer.write(encode(json_entry(EntryKind.REQUEST, time.monotonic(), request)))
            return await asyncio.wait_for(pending, ANSWER_TIMEOUT_S)
        except TimeoutError:
            raise InstrumentUnavailable(
                f"The instrument did not answer within {ANSWER_TIMEOUT_S:g} s."
            ) from None
        finally:
            del self._pending[request_id]
