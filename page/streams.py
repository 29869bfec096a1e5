"""What goes to the browsers that listen: each has its own queue, and none waits for another."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterable
from typing import Any, NamedTuple

from page.answers import text_of

MOST_STREAMS = 32
MOST_WAITED_S = 2.0  #: a line that is slower than what is told is begun anew, with what is new then
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
    """Events that wait for one browser, and a history that it gets while none does.

    `drop` is called when it does not take them.
    """

    def __init__(
        self, first: bytes, history: Iterable[Message], drop: Callable[[], None], now_s: float
    ) -> None:
        self._waiting: deque[tuple[float, bytes]] = deque(((now_s, first),))
        self._history = deque(history)
        self._drop = drop
        self._news = asyncio.Event()
        self._news.set()
        self.ended = False

    def put(self, data: bytes, now_s: float) -> None:
        """Let this wait too."""
        if self._waiting and now_s - self._waiting[0][0] > MOST_WAITED_S:
            self.end()
            self._drop()
        elif not self.ended:
            self._waiting.append((now_s, data))
            self._news.set()

    def end(self) -> None:
        """Forget what waits; whoever reads comes to an end."""
        self.ended = True
        self._waiting.clear()
        self._history.clear()
        self._news.set()

    async def read(self) -> AsyncIterator[bytes]:
        """What is to be sent, until the end."""
        while not self.ended:
            await self._news.wait()
            self._news.clear()
            while self._waiting or self._history:
                if not self._waiting:
                    yield self._history.popleft().encode()
                    continue
                yield self._waiting[0][1]
                if self._waiting:  # it waits until the line has taken the one before, and may have been ended
                    self._waiting.popleft()


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

    def join(
        self, greeting: list[Message], history: list[Message], drop: Callable[[], None], now_s: float
    ) -> Stream:
        """A new one, which begins with `greeting`, and has `history` when there is time."""
        first = BEGIN + b"".join(message.encode() for message in greeting)
        stream = Stream(first, history, drop, now_s)
        self._streams.add(stream)
        return stream

    def leave(self, stream: Stream) -> None:
        """Send it nothing more."""
        self._streams.discard(stream)
        stream.end()

    def send(self, messages: list[Message], now_s: float) -> None:
        """Let each browser have these."""
        if self._streams:
            self.send_bytes(b"".join(message.encode() for message in messages), now_s)

    def send_bytes(self, data: bytes, now_s: float) -> None:
        """Let each browser have this, as it stands."""
        for stream in list(self._streams) if data else ():
            stream.put(data, now_s)

    def end(self) -> None:
        """End all."""
        for stream in list(self._streams):
            self.leave(stream)
