"""Server-Sent Events: one stream per browser, and the broadcaster that feeds all streams."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from typing import Any, NamedTuple

from pneuforce.web.server.http_json import to_json

MAX_STREAMS = 32
#: A stream is closed for a new client only if its address has at least this number of streams more than the
#: address of the client. Two addresses therefore never close the streams of each other in turn.
MIN_DIFFERENCE = 2
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


class StreamOwner(NamedTuple):
    """Client that opens an event stream."""

    network: str  #: address of the client, or its network, as in `client_network.py`
    is_known: bool  #: a user has logged in with this browser


class EventStream:
    """Queue of messages for one browser.

    New messages are sent first. The history is sent only when no new message waits. `disconnect` is called if
    the browser does not read the messages.
    """

    def __init__(
        self,
        owner: StreamOwner,
        first: bytes,
        history: Iterable[SseMessage],
        disconnect: Callable[[], None],
        now_s: float,
    ) -> None:
        self.owner = owner
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


def stream_to_close(owners: Sequence[StreamOwner], newcomer: StreamOwner) -> int | None:
    """Return the index of the stream to close for a new client; None if the new client is rejected.

    `owners` are the owners of all open streams, oldest first. A browser that has logged in replaces a browser
    that has not logged in. Otherwise, the address with the most streams gives one to an address with fewer
    streams. The newest stream of that address is closed, so that older browsers stay connected.
    """
    counts = Counter(owner.network for owner in owners)
    candidates = [owner for owner in owners if newcomer.is_known and not owner.is_known] or [
        owner
        for owner in owners
        if owner.is_known <= newcomer.is_known
        and counts[owner.network] - counts[newcomer.network] >= MIN_DIFFERENCE
    ]
    if not candidates:
        return None
    chosen = max(candidates, key=lambda owner: counts[owner.network])
    return max(index for index, owner in enumerate(owners) if owner == chosen)


class EventBroadcaster:
    """Set of open event streams. Each message is sent to all streams."""

    def __init__(self) -> None:
        self._streams: dict[EventStream, None] = {}  # oldest first

    def __len__(self) -> int:
        return len(self._streams)

    def make_room(self, newcomer: StreamOwner) -> bool:
        """Close a stream if all places are used. Return False if no stream can be opened for the newcomer."""
        if len(self._streams) < MAX_STREAMS:
            return True
        streams = list(self._streams)
        index = stream_to_close([stream.owner for stream in streams], newcomer)
        if index is None:
            return False
        self.close_stream(streams[index])
        return True

    def open_stream(
        self,
        owner: StreamOwner,
        initial: list[SseMessage],
        history: list[SseMessage],
        disconnect: Callable[[], None],
        now_s: float,
    ) -> EventStream:
        """Return a new stream that sends `initial` first, and `history` when no new message waits."""
        first = RETRY_FIELD + b"".join(message.encode() for message in initial)
        stream = EventStream(owner, first, history, disconnect, now_s)
        self._streams[stream] = None
        return stream

    def close_stream(self, stream: EventStream) -> None:
        """Close one stream and remove the stream from the set."""
        self._streams.pop(stream, None)
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
