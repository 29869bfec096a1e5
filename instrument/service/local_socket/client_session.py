"""Session callbacks of one client of the local socket: the web process, a recorder, or an unknown program."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Protocol

from pneuforce.instrument.recording.broadcaster import MAX_BACKLOG_BYTES, Subscriber
from pneuforce.instrument.stream.entry import EntryDecoder, EntryKind, StreamEntry, StreamError, encode

REQUESTS_PER_TICK = 4  #: limited because each request takes about 0.4 ms of the event loop
MAX_WAITING_REQUESTS = 32
MAX_REQUEST_BYTES = 16_384
SUBSCRIBE_TIMEOUT_S = 2.0
WRITERS = frozenset({"web", "mqtt"})  #: subscriptions whose clients may send requests


class SessionHost(Protocol):
    """Server to which the client sessions belong."""

    def admit(self, client: ClientSession) -> bool:
        """Add a client. Return False if too many clients are connected."""
        ...

    def subscribe(self, subscription: str) -> Subscriber:
        """Return a subscriber that receives all entries from now on.

        Raises StreamError if the subscription is not offered.
        """
        ...

    def recording_failed(self, why: str) -> None:
        """Handle a recording that stopped by itself."""
        ...

    def failed(self, subscription: str, why: str) -> None:
        """Log a client that was disconnected because of an error."""
        ...

    def too_slow(self, subscriber: Subscriber, backlog_bytes: int) -> None:
        """Handle a client that was disconnected because it read too slowly."""
        ...

    def answer(self, request: StreamEntry, channel: str) -> StreamEntry:
        """Execute a request of the web page or of MQTT. Raises StreamError if it is malformed."""
        ...

    def log_login(self, entry: StreamEntry) -> None:
        """Log logins, logouts and failed logins on the web page. Raises StreamError for a malformed entry."""
        ...

    def remove(self, client: ClientSession) -> None:
        """Remove a client that has disconnected."""
        ...


class ClientSession(asyncio.Protocol):
    """Connection of one client. Each tick of the host executes a limited number of its requests."""

    def __init__(self, host: SessionHost) -> None:
        self.subscriber: Subscriber | None = None
        self._host = host
        self._decoder = EntryDecoder(MAX_REQUEST_BYTES)
        self._requests: deque[StreamEntry] = deque()
        self._requests_left = REQUESTS_PER_TICK
        self._first_tick_s: float | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Register with the server. Disconnect if too many clients are connected."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if not self._host.admit(self):
            transport.abort()

    @property
    def subscription(self) -> str:
        """Return the name of the subscription, empty before the client has subscribed."""
        return self.subscriber.subscription if self.subscriber else ""

    def data_received(self, data: bytes) -> None:
        """Handle entries from the client. An error disconnects only this client."""
        try:
            for entry in self._decoder.feed(data):
                self._handle(entry)
        except Exception as error:
            self._host.failed(self.subscription, str(error) or type(error).__name__)
            self._transport.abort()

    def _handle(self, entry: StreamEntry) -> None:
        if entry.kind is EntryKind.SUBSCRIBE and self.subscriber is None:
            self.subscriber = self._host.subscribe(entry.json_body["want"])
        elif entry.kind is EntryKind.REQUEST and self.subscription in WRITERS:
            self._queue(entry)
        elif entry.kind is EntryKind.LOGIN and self.subscription == "web":
            self._host.log_login(entry)
        elif entry.kind is EntryKind.FAILURE and self.subscription == "record":
            self._host.recording_failed(" ".join(entry.body.decode(errors="replace").split()))
        else:
            raise StreamError(f"an entry of kind {entry.kind.name} is not allowed now")

    def _queue(self, request: StreamEntry) -> None:
        if len(self._requests) >= MAX_WAITING_REQUESTS:
            raise StreamError("too many requests are waiting")
        self._requests.append(request)
        self._answer_some()

    def _answer_some(self) -> None:
        while self._requests and self._requests_left:
            self._requests_left -= 1
            self._transport.write(encode(self._host.answer(self._requests.popleft(), self.subscription)))

    def tick(self, now_s: float) -> None:
        """Send waiting entries. Disconnect a client that reads too slowly or does not subscribe in time."""
        self._first_tick_s = now_s if self._first_tick_s is None else self._first_tick_s
        self._requests_left = REQUESTS_PER_TICK
        if self.subscriber is None:
            if now_s - self._first_tick_s > SUBSCRIBE_TIMEOUT_S:
                self._transport.abort()
            return
        self._answer_some()
        backlog_bytes = self.subscriber.backlog_bytes + self._transport.get_write_buffer_size()
        if backlog_bytes > MAX_BACKLOG_BYTES:
            self._transport.abort()
            self._host.too_slow(self.subscriber, backlog_bytes)
        elif data := self.subscriber.take_all():
            self._transport.write(data)

    def close(self) -> None:
        """Send the remaining data, then close the connection."""
        self._transport.close()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """Remove this client from the server."""
        self._host.remove(self)
