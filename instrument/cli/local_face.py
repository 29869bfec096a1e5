"""The local face: a Unix socket for the page and for recorders, which are processes of their own."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from instrument.cli.begin import begin_of
from instrument.cli.guest import Guest
from instrument.cli.local_socket import LocalSocket
from instrument.config import Configuration
from instrument.coupling import Coupling
from instrument.errors import FaceError
from instrument.tape.checkpoint import freeze
from instrument.tape.entry import Entry, Kind, TapeError, encode, told
from instrument.tape.feed import Feed, Listener
from registers.asked import Malformed, asked
from registers.source import Peer, Source
from registers.sparing_log import SparingLog

log = logging.getLogger("pneuforce")

SNAPSHOT_S = 0.05
HEALTH_S = 1.0
LEAVE_S = 0.5  #: for listeners to take what they are still owed
MOST_GUESTS = 16
DECIDE_S = 1.5  #: an order that is on its way for longer is given up
NO_TIME_S = 1e12
LOOK_S = 1.0  #: how often the socket looks for its name
SAY_AGAIN_S = 60.0
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
        self._socket: LocalSocket | None = None
        self._reopening: asyncio.Task[None] | None = None
        self._snapshot_s = self._health_s = self._look_s = 0.0
        self._say = SparingLog(log, SAY_AGAIN_S).say

    async def open(self, path: Path | None) -> None:
        """Listen at `path`, for this user alone; nowhere for None. Raises FaceError."""
        if path is not None:
            self._socket = LocalSocket(path, lambda: Guest(self))
            await self._socket.open()

    # ---- as a face of the host

    def on_sample(self, now_s: float) -> None:
        """Leave it to the next beat: samples are told in handfuls."""

    def tick(self, now_s: float) -> None:
        """Tell what has come since the last beat."""
        if now_s >= self._look_s:
            self._look_s = now_s + LOOK_S
            self._look_for_our_name(now_s)
        if not self.guests:
            return
        if now_s >= self._snapshot_s:
            self._snapshot_s = now_s + SNAPSHOT_S
            self.feed.tell(Kind.SNAPSHOT, now_s, self.source.snapshot(PAGE, now_s)._asdict())
        if now_s >= self._health_s:
            self._health_s = now_s + HEALTH_S
            recording = {"on": self.recording, "trouble": self.trouble}
            self.feed.tell(Kind.HEALTH, now_s, {**self._health(now_s), "recording": recording})
        self._beat(now_s)

    def _beat(self, now_s: float) -> None:
        for guest in list(self.guests):
            guest.beat(now_s)

    def _look_for_our_name(self, now_s: float) -> None:
        """Whoever comes must find the socket: where its name was taken away it listens anew."""
        own = self._socket
        if own is None or own.in_place or not (self._reopening is None or self._reopening.done()):
            return
        self._say(now_s, "the local socket %s was taken away; listening anew", own.path)
        own.close()
        self._reopening = asyncio.get_running_loop().create_task(self._reopen(own))

    async def _reopen(self, own: LocalSocket) -> None:
        try:
            await own.open()
        except FaceError as error:
            self._say(time.monotonic(), "nobody can look: %s", error)

    @property
    def recording(self) -> bool:
        """Whether a recorder listens."""
        return any(guest.wants == "record" for guest in self.guests)

    async def close(self, why: str) -> None:
        """Say that the instrument ends, and let everybody have what is left."""
        if self._socket is None:
            return
        if self._reopening is not None:
            self._reopening.cancel()
        now_s = time.monotonic()
        self.feed.tell(Kind.END, now_s, {"why": why})
        self._beat(now_s)
        for guest in self.guests:
            guest.leave()
        while self.guests and time.monotonic() < now_s + LEAVE_S:
            await asyncio.sleep(0.01)
        self._socket.close()

    # ---- for guests

    def admit(self, guest: Guest) -> bool:
        """Whether there is room for one more."""
        if len(self.guests) >= MOST_GUESTS:
            return False
        self.guests.add(guest)
        return True

    def gone(self, guest: Guest) -> None:
        """Forget a guest; it tells it once."""
        self.guests.discard(guest)
        if guest.listener is not None:
            self.feed.listeners.remove(guest.listener)

    def welcome(self, wants: str) -> Listener:
        """A listener that has all from now on. Raises KeyError or TapeError: nobody may want that."""
        if wants not in self.feed.offers:
            raise TapeError(f"nobody may {wants} this: it is a replay, whose file can be copied")
        listener, now_s = Listener(wants), time.monotonic()
        now = self.source.snapshot(PAGE, now_s)
        begin = begin_of(self._configuration, "simulated" in now.status, now.faults) | {"replay": self.replay}
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
            values = asked(facts["values"])
            if values != {"mode": "vent"}:
                _refuse_old(facts.get("seen_s"), now_s)
            refusal, why = self.source.write(PAGE, values, now_s), ""
        except Malformed as error:
            refusal, why = "malformed", str(error)
        return told(Kind.ANSWER, now_s, {"id": facts.get("id"), "refusal": str(refusal), "why": why})


def _refuse_old(seen_s: object, now_s: float) -> None:
    """Raises Malformed where what somebody decided upon is past: a page that hung must not go on with it.

    `seen_s` is the time of the snapshot that was looked at.
    """
    if not isinstance(seen_s, int | float) or not abs(seen_s) < NO_TIME_S:
        raise Malformed("seen_s is missing: the time of the state that was decided upon")
    if not -DECIDE_S <= now_s - seen_s <= DECIDE_S:
        raise Malformed(f"what it was decided upon is {now_s - seen_s:.1f} s old: look again")
