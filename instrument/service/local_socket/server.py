"""Server of the local Unix socket for the web process and for recorders."""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pneuforce.errors import ServerError
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.broadcaster import EntryBroadcaster, Subscriber
from pneuforce.instrument.recording.checkpoint import save_session
from pneuforce.instrument.service.host.loop import ServedSource
from pneuforce.instrument.service.local_socket.client_session import ClientSession
from pneuforce.instrument.service.local_socket.stream_header import stream_header
from pneuforce.instrument.service.local_socket.unix_socket import LocalSocket
from pneuforce.instrument.service.local_socket.web_peer import parse_login, peer_of
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, StreamError, encode, json_entry
from pneuforce.registers.source import Peer
from pneuforce.registers.write_request import MalformedWriteRequest, parse_write_request
from pneuforce.support.counted import counted
from pneuforce.support.rejected_write import RejectedWrite
from pneuforce.support.throttle import RateLimitedLogger

log = logging.getLogger("pneuforce")

SNAPSHOT_S = 0.05
HEALTH_S = 1.0
CLOSE_S = 0.5  #: time for the clients to read the remaining entries at the end
MAX_CLIENTS = 16
MAX_REQUEST_AGE_S = 1.5  #: a request is rejected if the page showed a state older than this
MAX_TIME_S = 1e12
MAX_LOGGED_BYTES = 200  #: bytes of a rejected request of the web page that the log shows
CHECK_S = 1.0  #: period at which the name of the socket in the file system is checked
LOG_PERIOD_S = 60.0
WEB = Peer("web")


class LocalServer:
    """Output channel for the clients of the local socket; executes the requests of the web page."""

    def __init__(
        self,
        session: Session,
        source: ServedSource,
        broadcaster: EntryBroadcaster,
        configuration: Configuration,
        health: Callable[[float], dict[str, Any]],
    ) -> None:
        self.session = session
        self.source = source
        self.broadcaster = broadcaster
        self.clients: set[ClientSession] = set()
        self.recording_error = ""  #: reason why the last recording stopped by itself, or empty
        self.replay = ""  #: name of the replayed recording; empty if there is a rig
        self._web_peer = WEB  # user or browser that wrote last; the page shows the reject reason of this peer
        self._configuration = configuration
        self._health = health
        self._socket: LocalSocket | None = None
        self._reopening: asyncio.Task[None] | None = None
        self._snapshot_s = self._health_s = self._check_s = 0.0
        self._warn = RateLimitedLogger(log, LOG_PERIOD_S).warning
        self._warn_of_login = RateLimitedLogger(log, LOG_PERIOD_S).warning
        self._warn_of_client = RateLimitedLogger(log).warning

    async def open(self, path: Path | None) -> None:
        """Listen at `path`, for this user only. Do nothing if `path` is None. Raises PneuforceError."""
        if path is not None:
            self._socket = LocalSocket(path, lambda: ClientSession(self))
            await self._socket.open()

    # ---- output channel of the host

    def on_sample(self, now_s: float) -> None:
        """Do nothing: samples are sent in groups at the next tick."""

    def tick(self, now_s: float) -> None:
        """Send everything that was published since the last tick."""
        if now_s >= self._check_s:
            self._check_s = now_s + CHECK_S
            self._check_name(now_s)
        if not self.clients:
            return
        if now_s >= self._snapshot_s:
            self._snapshot_s = now_s + SNAPSHOT_S
            snapshot = self.source.snapshot(self._web_peer, now_s)._asdict()
            self.broadcaster.publish_json(EntryKind.SNAPSHOT, now_s, snapshot)
        if now_s >= self._health_s:
            self._health_s = now_s + HEALTH_S
            recording = {"on": self.recording, "trouble": self.recording_error}
            health = {**self._health(now_s), "recording": recording}
            self.broadcaster.publish_json(EntryKind.HEALTH, now_s, health)
        self._tick_clients(now_s)

    def _tick_clients(self, now_s: float) -> None:
        for client in list(self.clients):
            client.tick(now_s)

    def _check_name(self, now_s: float) -> None:
        """Listen again if the name of the socket was removed from the file system."""
        socket = self._socket
        reopening = self._reopening is not None and not self._reopening.done()
        if socket is None or socket.in_place or reopening:
            return
        self._warn(now_s, "the local socket %s was removed; listening again", socket.path)
        socket.close()
        self._reopening = asyncio.get_running_loop().create_task(self._reopen(socket))

    async def _reopen(self, socket: LocalSocket) -> None:
        try:
            await socket.open()
        except ServerError as error:
            self._warn(time.monotonic(), "web page and recorders cannot connect: %s", error)

    @property
    def recording(self) -> bool:
        """Return True if a recorder is connected."""
        return any(client.subscription == "record" for client in self.clients)

    async def close(self, why: str) -> None:
        """Send the end of the instrument and give the clients time to read the remaining entries."""
        if self._socket is None:
            return
        if self._reopening is not None:
            self._reopening.cancel()
        now_s = time.monotonic()
        self.broadcaster.publish_json(EntryKind.END, now_s, {"why": why})
        self._tick_clients(now_s)
        for client in self.clients:
            client.close()
        while self.clients and time.monotonic() < now_s + CLOSE_S:
            await asyncio.sleep(0.01)
        self._socket.close()

    # ---- host of the client sessions

    def admit(self, client: ClientSession) -> bool:
        """Add a client; return False if too many are connected."""
        if len(self.clients) >= MAX_CLIENTS:
            return False
        self.clients.add(client)
        return True

    def remove(self, client: ClientSession) -> None:
        """Remove a client and its subscription."""
        self.clients.discard(client)
        if client.subscriber is not None:
            self.broadcaster.subscribers.remove(client.subscriber)

    def subscribe(self, subscription: str) -> Subscriber:
        """Return a subscriber that receives the header, then all later entries.

        A recorder receives a checkpoint after the header.

        Raises StreamError if the subscription is not offered.
        """
        if subscription not in self.broadcaster.offered:
            raise StreamError(
                f"{subscription} is not offered; during a replay, copy the file of the recording"
            )
        subscriber, now_s = Subscriber(subscription), time.monotonic()
        snapshot = self.source.snapshot(WEB, now_s)
        header = stream_header(self._configuration, "simulated" in snapshot.status, snapshot.faults)
        header_entry = json_entry(EntryKind.HEADER, now_s, header | {"replay": self.replay})
        subscriber.append(EntryKind.HEADER, encode(header_entry))
        if EntryKind.CHECKPOINT in subscriber.kinds:
            checkpoint = StreamEntry(EntryKind.CHECKPOINT, now_s, save_session(self.session))
            subscriber.append(EntryKind.CHECKPOINT, encode(checkpoint))
            self.recording_error, self.session.instrument.recording_down = "", False
        self.broadcaster.subscribers.append(subscriber)
        return subscriber

    def recording_failed(self, why: str) -> None:
        """Log the reason why a recording stopped by itself, and set the status bit `maintenance_required`."""
        self._warn_of_client(time.monotonic(), "the recording stopped: %s", why)
        self.recording_error, self.session.instrument.recording_down = why, True

    def failed(self, subscription: str, why: str) -> None:
        """Log a client that was disconnected because of an error."""
        client = f"client of the local socket ({subscription or 'without a subscription'})"
        self._warn_of_client(time.monotonic(), "%s disconnected: %s", client, why)

    def too_slow(self, subscriber: Subscriber, backlog_bytes: int) -> None:
        """Handle a client that was disconnected because it read too slowly. Its recording has failed."""
        why = f"the client was {backlog_bytes / 1e6:.0f} MB behind"
        if subscriber.subscription == "record":
            self.recording_failed(why)
        else:
            self.failed(subscriber.subscription, why)

    def log_login(self, entry: StreamEntry) -> None:
        """Log a login, a logout or failed logins of users. Raises StreamError if the entry is invalid."""
        report, now_s = parse_login(entry), time.monotonic()
        if not report.has_failed:
            self.source.log_login(report.peer, report.kind, report.result, now_s)
            return
        self.source.log_failed_logins(report.peer, report.result, report.times, now_s, report.user)
        message = "web: login from %s failed %s: %s; if no user did this, find out who uses this address"
        self._warn_of_login(
            now_s,
            message,
            report.peer.address,
            counted(report.times, "time"),
            report.result.replace("_", " "),
        )

    def answer(self, request: StreamEntry, channel: str) -> StreamEntry:
        """Execute a request of the channel "web" or "mqtt" like a write from a bus. MQTT can only vent.

        Raises StreamError if the request has no values or an invalid address.
        """
        facts, now_s = request.json_body, time.monotonic()
        if not isinstance(facts, dict) or not isinstance(facts.get("values"), dict):
            raise StreamError("a request contains no values")
        peer = peer_of(facts, channel)
        if channel == WEB.channel:
            self._web_peer = peer
        try:
            values = parse_write_request(facts["values"])
            if values != {"mode": "vent"}:
                if channel != WEB.channel:
                    raise MalformedWriteRequest("a write by MQTT", "MQTT can only vent")
                _check_age(facts.get("seen_s"), now_s)
            reject_reason, why = self.source.write(peer, values, now_s), ""
        except MalformedWriteRequest as error:
            reject_reason, why = "malformed", str(error)
            body = json.dumps(facts["values"]).encode()[:MAX_LOGGED_BYTES]
            rejected = RejectedWrite(body, reject_reason, error.written[:MAX_LOGGED_BYTES], error.allowed)
            self.source.log_rejected_write(peer, rejected, now_s)
        answer = {"id": facts.get("id"), "reject_reason": str(reject_reason), "why": why}
        return json_entry(EntryKind.ANSWER, now_s, answer)


def _check_age(seen_s: object, now_s: float) -> None:
    """Raise MalformedWriteRequest if the page showed an old state when the operator sent the request.

    `seen_s` is the time of the snapshot that the page showed. A page in a stopped browser shows an old state.
    """
    if not isinstance(seen_s, int | float) or not abs(seen_s) < MAX_TIME_S:
        raise MalformedWriteRequest(
            "no valid seen_s", "seen_s must be the time of the state that the page showed"
        )
    if not -MAX_REQUEST_AGE_S <= now_s - seen_s <= MAX_REQUEST_AGE_S:
        raise MalformedWriteRequest(
            "an old request", f"the page showed a state that is {now_s - seen_s:.1f} s old: try again"
        )
