"""The local face: a Unix socket for the page and for recorders, which are processes of their own."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import stat
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from instrument.cli.begin import begin_of
from instrument.config import Configuration
from instrument.coupling import Coupling
from instrument.errors import FaceError
from instrument.tape.checkpoint import freeze
from instrument.tape.entry import Decoder, Entry, Kind, TapeError, encode, told
from instrument.tape.feed import MOST_BACKLOG, Feed, Listener
from registers.asked import Malformed, asked
from registers.source import Peer, Source

log = logging.getLogger("pneuforce")

SNAPSHOT_S = 0.05
HEALTH_S = 1.0
LEAVE_S = 0.5  #: for listeners to take what they are still owed
MOST_GUESTS = 16
PAGE = Peer("page")


class LocalFace:
    """Gives the feed to whoever connects, and takes the page's requests."""

    def __init__(
        self,
        coupling: Coupling,
        source: Source,
        feed: Feed,
        configuration: Configuration,
        health: Callable[[float], dict[str, Any]],
    ) -> None:
        self.coupling = coupling
        self.source = source
        self.feed = feed
        self.guests: set[Guest] = set()
        self.trouble = ""  #: why the last recording stopped, empty where it did not by itself
        self.replay = ""  #: the recording that is shown in the place of a rig
        self._configuration = configuration
        self._health = health
        self._server: asyncio.Server | None = None
        self._path: Path | None = None
        self._snapshot_s = self._health_s = 0.0

    async def open(self, path: Path | None) -> None:
        """Listen at `path`, for this user alone; nowhere for None. Raises FaceError."""
        if path is None:
            return
        try:
            _make_free(path)
            umask = os.umask(0o177)
            try:
                loop = asyncio.get_running_loop()
                self._server = await loop.create_unix_server(lambda: Guest(self), str(path))
            finally:
                os.umask(umask)
        except FaceError:  # an OSError too, that has its sentence
            raise
        except OSError as error:
            raise FaceError(f"local.socket = {path}: {error.strerror or error}") from None
        self._path = path

    # ---- as a face of the host

    def on_sample(self, now_s: float) -> None:
        """Leave it to the next beat: samples are told in handfuls."""

    def tick(self, now_s: float) -> None:
        """Tell what has come since the last beat."""
        if not self.guests:
            return
        if now_s >= self._snapshot_s:
            self._snapshot_s = now_s + SNAPSHOT_S
            shown = self.source.snapshot(PAGE, now_s)._asdict()
            self.feed.tell(Kind.SNAPSHOT, now_s, {name: _plain(value) for name, value in shown.items()})
        if now_s >= self._health_s:
            self._health_s = now_s + HEALTH_S
            recording = {"on": self.recording, "trouble": self.trouble}
            self.feed.tell(Kind.HEALTH, now_s, {**self._health(now_s), "recording": recording})
        self._flush()

    def _flush(self) -> None:
        for guest in list(self.guests):
            guest.flush()

    @property
    def recording(self) -> bool:
        """Whether a recorder listens."""
        return any(guest.listener and guest.listener.wants == "record" for guest in self.guests)

    async def close(self, why: str) -> None:
        """Say that the instrument ends, and let everybody have what is left."""
        if self._server is None:
            return
        self._server.close()
        self.feed.tell(Kind.END, time.monotonic(), {"why": why})
        self._flush()
        for guest in self.guests:
            guest.leave()
        until_s = time.monotonic() + LEAVE_S
        while self.guests and time.monotonic() < until_s:
            await asyncio.sleep(0.01)
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    # ---- for guests

    def welcome(self, wants: str) -> Listener:
        """A listener that has all from now on. Raises KeyError: nobody may want that."""
        if wants not in self.feed.offers:
            raise KeyError(f"{wants}: there is none to be had of this")
        listener, now_s = Listener(wants), time.monotonic()
        simulated = "simulated" in self.source.snapshot(PAGE, now_s).status
        begin = begin_of(self._configuration, simulated) | {"replay": self.replay}
        listener.put(Kind.BEGIN, encode(told(Kind.BEGIN, now_s, begin)))
        if Kind.CHECKPOINT in listener.kinds:
            listener.put(Kind.CHECKPOINT, encode(Entry(Kind.CHECKPOINT, now_s, freeze(self.coupling))))
            self.trouble, self.coupling.instrument.recording_down = "", False
        self.feed.listeners.append(listener)
        return listener

    def troubled(self, why: str) -> None:
        """A recording has stopped by itself: whoever maintains the instrument is to know."""
        log.warning("the recording stopped: %s", why)
        self.trouble, self.coupling.instrument.recording_down = why, True

    def let_go(self, listener: Listener, behind: int) -> None:
        """Somebody takes too slowly what he is told: a recording that has lost something is over."""
        why = f"it was {behind / 1e6:.0f} MB behind"
        if listener.wants == "record":
            self.troubled(why)
        else:
            log.warning("a %s is let go: %s", listener.wants, why)

    def answer(self, request: Entry) -> Entry:
        """Carry out a request of the page, as any bus's. Raises TapeError: it is no request."""
        facts, now_s = request.facts, time.monotonic()
        if not isinstance(facts, dict) or not isinstance(facts.get("values"), dict):
            raise TapeError("a request without values")
        try:
            refusal, why = self.source.write(PAGE, asked(facts["values"]), now_s), ""
        except Malformed as error:
            refusal, why = "malformed", str(error)
        return told(Kind.ANSWER, now_s, {"id": facts.get("id"), "refusal": str(refusal), "why": why})


class Guest(asyncio.Protocol):
    """One connection: a page, or a recorder."""

    def __init__(self, face: LocalFace) -> None:
        self.listener: Listener | None = None
        self._face = face
        self._decoder = Decoder()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Let it in, where there is room."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if len(self._face.guests) >= MOST_GUESTS:
            transport.abort()
        else:
            self._face.guests.add(self)

    def data_received(self, data: bytes) -> None:
        """Hear what it wants."""
        try:
            for entry in self._decoder.feed(data):
                self._hear(entry)
        except Exception as error:  # whatever a stranger says, it costs him the connection and nobody else
            log.warning("a guest of the local socket is turned away: %s", str(error) or type(error).__name__)
            self._transport.abort()

    def _hear(self, entry: Entry) -> None:
        if entry.kind is Kind.WANT and self.listener is None:
            self.listener = self._face.welcome(entry.facts["want"])
        elif entry.kind is Kind.REQUEST and self.listener is not None and self.listener.wants == "page":
            self._transport.write(encode(self._face.answer(entry)))
        elif entry.kind is Kind.TROUBLE:
            self._face.troubled(entry.body.decode(errors="replace"))
        else:
            raise TapeError(f"{entry.kind.name} is nothing that it may say now")

    def flush(self) -> None:
        """Send what waits; one that is too far behind is let go."""
        if self.listener is None:
            return
        behind = self.listener.behind + self._transport.get_write_buffer_size()
        if behind > MOST_BACKLOG:
            self._transport.abort()
            self._face.let_go(self.listener, behind)
        elif data := self.listener.take():
            self._transport.write(data)

    def leave(self) -> None:
        """Send what is left, then close."""
        self._transport.close()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """Forget it."""
        self._face.guests.discard(self)
        if self.listener is not None:
            self._face.feed.listeners.remove(self.listener)


def _make_free(path: Path) -> None:
    """Remove a socket that nobody serves any more. Raises FaceError where somebody does, or it is a file."""
    with suppress(FileNotFoundError):
        if not stat.S_ISSOCK(path.stat().st_mode):
            raise FaceError(f"local.socket = {path} is a file that is no socket: name another")
        with socket.socket(socket.AF_UNIX) as probe:
            if probe.connect_ex(str(path)) == 0:
                raise FaceError(f"local.socket = {path} is another running instrument's: give each its own")
        path.unlink()


def _plain(value: Any) -> Any:
    """What JSON knows of a quantity: null for NaN, a sorted list for a set."""
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    return sorted(value) if isinstance(value, frozenset) else value
