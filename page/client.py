"""The running instrument, at the other end of its local socket: listened to for ever, and asked."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import Any

from instrument.errors import PneuforceError
from instrument.tape.entry import Decoder, Entry, Kind, TapeError, encode, told
from page.view import View

BACK_OFF_S = (0.1, 3.0)
ANSWER_S = 1.0
READ_BYTES = 65_536
MOST_UNREAD = 65_536  #: bytes of requests that an instrument that hangs has not taken


class NoAnswer(PneuforceError, TimeoutError):
    """The instrument did not say what became of a request."""


class Instrument:
    """Fills a view; takes requests."""

    def __init__(self, socket: Path, view: View) -> None:
        self._socket = socket
        self._view = view
        self._writer: asyncio.StreamWriter | None = None
        self._numbers = count(1)
        self._waiting: dict[int, asyncio.Future[Mapping[str, Any]]] = {}
        self._back_off_s = BACK_OFF_S[0]

    async def follow(self) -> None:
        """Listen until cancelled; whenever the instrument is gone, try again."""
        while True:
            try:
                await self._listen()
                self._gone("The instrument has closed the connection.")
            except (TapeError, struct.error) as error:
                self._gone(f"The instrument speaks another version than this page: {error}.")
            except OSError as error:
                self._gone(f"The instrument does not run here ({self._socket}: {error.strerror or error}).")
            await asyncio.sleep(self._back_off_s)
            self._back_off_s = min(2 * self._back_off_s, BACK_OFF_S[1])

    async def _listen(self) -> None:
        reader, writer = await asyncio.open_unix_connection(self._socket)
        try:
            writer.write(encode(told(Kind.WANT, time.monotonic(), {"want": "page"})))
            self._writer = writer
            decoder = Decoder()
            while data := await reader.read(READ_BYTES):
                for entry in decoder.feed(data):
                    self._take(entry)
        finally:
            self._writer = None
            writer.transport.abort()

    def _take(self, entry: Entry) -> None:
        if entry.kind is Kind.ANSWER:
            self._answered(entry.facts)
            return
        self._view.take(entry)
        self._back_off_s = BACK_OFF_S[0]

    def _answered(self, facts: Mapping[str, Any]) -> None:
        waiting = self._waiting.get(facts.get("id", 0))
        if waiting is not None and not waiting.done():
            waiting.set_result(facts)

    def _gone(self, why: str) -> None:
        self._view.lose(why)
        for waiting in self._waiting.values():
            if not waiting.done():
                waiting.set_exception(NoAnswer(why))

    async def ask(self, values: Mapping[str, Any], seen_s: float | None = None) -> Mapping[str, Any]:
        """What the instrument answers to a request that gives registers values. Raises NoAnswer.

        `seen_s` is the time of the state that it was decided upon; a vent needs none.
        """
        if self._writer is None:
            raise NoAnswer(self._view.why)
        if self._writer.transport.get_write_buffer_size() > MOST_UNREAD:
            raise NoAnswer("The instrument does not listen.")
        number = next(self._numbers)
        waiting = self._waiting[number] = asyncio.get_running_loop().create_future()
        try:
            request = {"id": number, "values": values, "seen_s": seen_s}
            self._writer.write(encode(told(Kind.REQUEST, time.monotonic(), request)))
            return await asyncio.wait_for(waiting, ANSWER_S)
        except TimeoutError:
            raise NoAnswer(f"The instrument did not answer within {ANSWER_S:g} s.") from None
        finally:
            del self._waiting[number]
