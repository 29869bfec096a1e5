"""A guest of the local socket: a page, a recorder, or a stranger who is not to hold anything up."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from typing import Protocol

from instrument.tape.entry import Decoder, Entry, Kind, TapeError, encode
from instrument.tape.feed import MOST_BACKLOG, Listener

log = logging.getLogger("pneuforce")

REQUESTS_PER_BEAT = 4  #: a page needs one now and then; each takes some 0.4 ms of the host's loop
MOST_WAITING = 32
LONGEST_REQUEST = 16_384
WANT_WITHIN_S = 2.0


class Host(Protocol):
    """What a guest is received by."""

    def admit(self, guest: Guest) -> bool:
        """Whether there is room for it."""
        ...

    def welcome(self, wants: str) -> Listener:
        """A listener that has all from now on. Raises KeyError: nobody may want that."""
        ...

    def troubled(self, why: str) -> None:
        """Hear that a recording has stopped by itself."""
        ...

    def let_go(self, listener: Listener, behind: int) -> None:
        """Hear that somebody takes too slowly what he is told."""
        ...

    def answer(self, request: Entry) -> Entry:
        """Carry out a request of the page. Raises TapeError: it is no request."""
        ...

    def gone(self, guest: Guest) -> None:
        """Forget it."""
        ...


class Guest(asyncio.Protocol):
    """One connection. It asks for as much as fits into a beat of the host, the rest waits."""

    def __init__(self, host: Host) -> None:
        self.listener: Listener | None = None
        self._host = host
        self._decoder = Decoder(LONGEST_REQUEST)
        self._requests: deque[Entry] = deque()
        self._left = REQUESTS_PER_BEAT
        self._came_s: float | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Come in, where there is room."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if not self._host.admit(self):
            transport.abort()

    @property
    def wants(self) -> str:
        """What it listens to, empty while it has not said so."""
        return self.listener.wants if self.listener else ""

    def data_received(self, data: bytes) -> None:
        """Say what it wants, and ask."""
        try:
            for entry in self._decoder.feed(data):
                self._hear(entry)
        except Exception as error:  # whatever a stranger says, it costs him the connection and nobody else
            log.warning("a guest of the local socket is turned away: %s", str(error) or type(error).__name__)
            self._transport.abort()

    def _hear(self, entry: Entry) -> None:
        if entry.kind is Kind.WANT and self.listener is None:
            self.listener = self._host.welcome(entry.facts["want"])
        elif entry.kind is Kind.REQUEST and self.wants == "page":
            self._ask(entry)
        elif entry.kind is Kind.TROUBLE and self.wants == "record":
            self._host.troubled(" ".join(entry.body.decode(errors="replace").split()))
        else:
            raise TapeError(f"{entry.kind.name} is nothing that it may say now")

    def _ask(self, request: Entry) -> None:
        if len(self._requests) >= MOST_WAITING:
            raise TapeError("it asks for more than can be answered")
        self._requests.append(request)
        self._answer_some()

    def _answer_some(self) -> None:
        while self._requests and self._left:
            self._left -= 1
            self._transport.write(encode(self._host.answer(self._requests.popleft())))

    def beat(self, now_s: float) -> None:
        """Send what waits; one that is too far behind, or does not say what it wants, is let go."""
        self._came_s = now_s if self._came_s is None else self._came_s
        self._left = REQUESTS_PER_BEAT
        if self.listener is None:
            if now_s - self._came_s > WANT_WITHIN_S:
                self._transport.abort()
            return
        self._answer_some()
        behind = self.listener.behind + self._transport.get_write_buffer_size()
        if behind > MOST_BACKLOG:
            self._transport.abort()
            self._host.let_go(self.listener, behind)
        elif data := self.listener.take():
            self._transport.write(data)

    def leave(self) -> None:
        """Take what is left, then go."""
        self._transport.close()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """It is gone, whoever ended it."""
        self._host.gone(self)
