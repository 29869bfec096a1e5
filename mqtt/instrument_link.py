"""Client of the local socket of the instrument: receives snapshots, and sends a vent."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import Any, Protocol

from pneuforce.instrument.stream.entry import (
    EntryDecoder,
    EntryKind,
    StreamEntry,
    StreamError,
    encode,
    json_entry,
)
from pneuforce.registers.sparkplug import Reading

RECONNECT_S = 1.0
SILENCE_S = (
    1.0  #: the instrument sends a snapshot each 50 ms; without one for this time, it cannot be reached
)
ANSWER_TIMEOUT_S = 1.0
READ_BYTES = 65_536
ACCEPTED = "accepted"
NO_ANSWER = "failed: the instrument did not answer"
NOT_CONNECTED = "failed: the instrument cannot be reached"


class ReadingSink(Protocol):
    """Receiver of the values of the instrument."""

    def on_reading(self, reading: Reading, t_s: float) -> None:
        """Handle a snapshot. `t_s` is its time on the monotonic clock of this computer."""
        ...

    def on_lost(self, why: str) -> None:
        """Handle the loss of the instrument."""
        ...


class InstrumentLink:
    """Connection to the instrument, which is opened again after each failure."""

    def __init__(self, socket: Path, address: str, sink: ReadingSink) -> None:
        """Create the link without connecting. `address` is that of the broker, for the event log."""
        self._socket, self._address, self._sink = socket, address, sink
        self._header: Mapping[str, Any] = {}
        self._writer: asyncio.StreamWriter | None = None
        self._numbers = count(1)
        self._answers: dict[int, asyncio.Future[str]] = {}

    async def run(self) -> None:
        """Receive until cancelled, and connect again after each failure."""
        while True:
            try:
                await self._receive()
                why = "the instrument has closed the connection"
            except TimeoutError:
                why = f"the instrument has sent nothing for {SILENCE_S:g} s"
            except (StreamError, struct.error, ValueError, TypeError, KeyError, AttributeError) as error:
                why = f"the instrument has another version ({error}): restart pneuforce"
            except OSError as error:
                why = f"the instrument is not running: {self._socket}: {error.strerror or error}"
            self._sink.on_lost(why)
            await asyncio.sleep(RECONNECT_S)

    async def vent(self) -> str:
        """Send a vent. Return the answer of the instrument, or why there is none."""
        if self._writer is None:
            return NOT_CONNECTED
        number = next(self._numbers)
        answer: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._answers[number] = answer
        request = {"id": number, "address": self._address, "values": {"mode": "vent"}}
        try:
            self._writer.write(encode(json_entry(EntryKind.REQUEST, time.monotonic(), request)))
            async with asyncio.timeout(ANSWER_TIMEOUT_S):
                return await answer
        except TimeoutError:
            return NO_ANSWER
        finally:
            del self._answers[number]

    async def _receive(self) -> None:
        reader, writer = await asyncio.open_unix_connection(self._socket)
        try:
            writer.write(encode(json_entry(EntryKind.SUBSCRIBE, time.monotonic(), {"want": "mqtt"})))
            self._writer = writer
            decoder = EntryDecoder()
            silent_since_s = time.monotonic()
            while data := await _read(reader):
                for entry in decoder.feed(data):
                    if self._process(entry):
                        silent_since_s = time.monotonic()
                if time.monotonic() - silent_since_s > SILENCE_S:
                    raise TimeoutError
        finally:
            self._writer = None
            writer.transport.abort()

    def _process(self, entry: StreamEntry) -> bool:
        """Process an entry. Return True if it is a snapshot."""
        if entry.kind is EntryKind.HEADER:
            self._header = entry.json_body
        elif entry.kind is EntryKind.SNAPSHOT:
            self._sink.on_reading({"header": self._header, "snapshot": entry.json_body}, entry.t_s)
        elif entry.kind is EntryKind.ANSWER:
            self._on_answer(entry.json_body)
        return entry.kind is EntryKind.SNAPSHOT

    def _on_answer(self, answer: Mapping[str, Any]) -> None:
        pending = self._answers.get(answer["id"])
        if pending is not None and not pending.done():
            reason = answer["reject_reason"]
            pending.set_result(ACCEPTED if reason == "none" else f"rejected: {reason}")


async def _read(reader: asyncio.StreamReader) -> bytes:
    """Return received bytes, empty at the end of the connection. Raises TimeoutError.

    `asyncio.wait_for` of Python 3.11 would ignore the end of the process if bytes arrive at the same time.
    """
    async with asyncio.timeout(SILENCE_S):
        return await reader.read(READ_BYTES)
