"""What goes to the browsers that listen: each has its own queue, and none waits for another."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Any, NamedTuple

from page.answers import text_of

MOST_STREAMS = 32
MOST_WAITING = 1_000_000  #: bytes that a browser may be behind: about a minute
BEGIN = b"retry: 1000\n\n"
NOTHING = b":\n\n"  #: a comment, which shows a connection that is gone


class Message(NamedTuple):
    """One event of the stream."""

    event: str
    data: Any

    def encode(self) -> bytes:
        """As Server-Sent Events have it."""
        return f"event: {self.event}\ndata: {text_of(self.data)}\n\n".encode()


class Stream:
    """Events that wait for one browser; `drop` is called when it does not take them."""

    def __init__(self, first: bytes, drop: Callable[[], None], most_waiting: int = MOST_WAITING) -> None:
        self._waiting: deque[bytes] = deque((first,))
        self._behind = 0  # the first, which is long, is not counted
        self._most_waiting = most_waiting
        self._drop = drop
        self._news = asyncio.Event()
        self._news.set()
        self.ended = False

    def put(self, data: bytes) -> None:
        """Let this wait too."""
        self._behind += len(data)
        if self._behind > self._most_waiting:
            self.end()
            self._drop()
        elif not self.ended:
            self._waiting.append(data)
            self._news.set()

    def end(self) -> None:
        """Forget what waits; whoever reads comes to an end."""
        self.ended = True
        self._waiting.clear()
        self._news.set()

    async def read(self) -> AsyncIterator[bytes]:
        """What is to be sent, until the end."""
        while not self.ended:
            await self._news.wait()
            self._news.clear()
            data, self._behind = b"".join(self._waiting), 0
            self._waiting.clear()
            if data:
                yield data


class Streams:
    """All browsers that listen."""

    def __init__(self) -> None:
        self._streams: set[Stream] = set()

    def __len__(self) -> int:
        return len(self._streams)

    @property
    def full(self) -> bool:
        """Whether no more may join."""
        return len(self._streams) >= MOST_STREAMS

    def join(self, greeting: list[Message], drop: Callable[[], None]) -> Stream:
        """A new one, which begins with `greeting`."""
        stream = Stream(BEGIN + b"".join(message.encode() for message in greeting), drop)
        self._streams.add(stream)
        return stream

    def leave(self, stream: Stream) -> None:
        """Send it nothing more."""
        self._streams.discard(stream)
        stream.end()

    def send(self, messages: list[Message]) -> None:
        """Let each browser have these."""
        if self._streams:
            self.send_bytes(b"".join(message.encode() for message in messages))

    def send_bytes(self, data: bytes) -> None:
        """Let each browser have this, as it stands."""
        for stream in list(self._streams) if data else ():
            stream.put(data)

    def end(self) -> None:
        """End all."""
        for stream in list(self._streams):
            self.leave(stream)
