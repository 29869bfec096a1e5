"""Server-Sent Events: one stream per browser, and the broadcaster that feeds all streams."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterable
from typing import Any, NamedTuple

from pneuforce.web.http_json import to_json

MAX_STREAMS = 32
#: Maximum age of the oldest unsent message. An older message shows that the connection is too slow. The
#: stream is then closed, so that the browser connects again and starts with current data.
MAX_LAG_S = 2.0
RETRY_FIELD = b"retry: 1000\n\n"  #: browsers connect again 1000 ms after a disconnection
KEEP_ALIVE = b":\n\n"  #: a comment; sending it detects a lost connection


class SseMessage(NamedTuple):
    """One Server-Sent Event: the event type, and data as JSON values."""

    event: str
    data: Any

    def encode(self) -> bytes:
        """Return the bytes on the wire (WHATWG HTML, section "Server-sent events")."""
        return f"event: {self.event}\ndata: {to_json(self.data)}\n\n".encode()


class EventStream:
    """Queue of messages for one browser.

    New messages are sent first. The history is sent only when no new message waits. `disconnect` is called if
    the browser does not read the messages.
    """

    def __init__(
        self, first: bytes, history: Iterable[SseMessage], disconnect: Callable[[], None], now_s: float
    ) -> None:
        self._queue: deque[tuple[float, bytes]] = deque(((now_s, first),))
        self._history = deque(history)
        self._disconnect = disconnect
        self._changed = asyncio.Event()
        self._changed.set()
        self.closed = False

    def enqueue(self, data: bytes, now_s: float) -> None:
        """Add data to the queue, or close the stream if the oldest data waits for more than `MAX_LAG_S`."""
        if self._queue and now_s - self._queue[0][0] > MAX_LAG_S:
            self.close()
            self._disconnect()
        elif not self.closed:
            self._queue.append((now_s, data))
            self._changed.set()

    def close(self) -> None:
        """Discard the data that waits, and end the reader."""
        self.closed = True
        self._queue.clear()
        self._history.clear()
        self._changed.set()

    async def read(self) -> AsyncIterator[bytes]:
        """Yield the data to send until the stream is closed."""
        while not self.closed:
            await self._changed.wait()
            self._changed.clear()
            while self._queue or self._history:
                if not self._queue:
                    yield self._history.popleft().encode()
                    continue
                # The data stays in the queue until it is sent, so that `enqueue` can check its age.
                yield self._queue[0][1]
                if self._queue:  # close() may have cleared the queue meanwhile
                    self._queue.popleft()


class EventBroadcaster:
    """Set of open event streams. Each message is sent to all streams."""

    def __init__(self) -> None:
        self._streams: set[EventStream] = set()

    def __len__(self) -> int:
        return len(self._streams)

    @property
    def is_full(self) -> bool:
        """Return True if no further stream can be opened."""
        return len(self._streams) >= MAX_STREAMS

    def open_stream(
        self,
        initial: list[SseMessage],
        history: list[SseMessage],
        disconnect: Callable[[], None],
        now_s: float,
    ) -> EventStream:
        """Return a new stream that sends `initial` first, and `history` when no new message waits."""
        first = RETRY_FIELD + b"".join(message.encode() for message in initial)
        stream = EventStream(first, history, disconnect, now_s)
        self._streams.add(stream)
        return stream

    def close_stream(self, stream: EventStream) -> None:
        """Close one stream and remove the stream from the set."""
        self._streams.discard(stream)
        stream.close()

    def send(self, messages: list[SseMessage], now_s: float) -> None:
        """Add messages to the queue of each stream."""
        if self._streams:
            self.send_bytes(b"".join(message.encode() for message in messages), now_s)

    def send_bytes(self, data: bytes, now_s: float) -> None:
        """Add encoded messages to the queue of each stream."""
        for stream in list(self._streams) if data else ():
            stream.enqueue(data, now_s)

    def close(self) -> None:
        """Close all streams."""
        for stream in list(self._streams):
            self.close_stream(stream)
