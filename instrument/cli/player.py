"""`pneuforce replay --config`: a recording on the buses, in the place of a host that reads a rig."""

from __future__ import annotations

import asyncio
import logging
import sys
import time
from collections.abc import Iterator
from heapq import merge
from operator import attrgetter
from pathlib import Path

from instrument.cli.logs import log_to_stderr
from instrument.cli.replay import replayable, start_of
from instrument.cli.serve import SWITCH_INTERVAL_S, Faces, Files, work_until_stopped
from instrument.config import Configuration
from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.guard import Guard
from instrument.host import TICK_S, Face
from instrument.played import Played
from instrument.rig.frames import SAMPLES_PER_S
from instrument.rig.link import Link
from instrument.settings import Identity
from instrument.tape.entry import Entry, Kind, told
from instrument.tape.feed import Feed
from instrument.tape.measured import pack
from instrument.tape.playing import Playing
from instrument.tape.reading import Recording
from instrument.tape.replay import Replayed

log = logging.getLogger("pneuforce")

PAUSE_S = 0.002
BEHIND_S = 0.02  #: a pause that the samples told of make up for
SAY_SLIPPED_S = 1.0


class Player:
    """Tells the faces of recorded samples, as a host tells them of a rig's."""

    def __init__(self, playing: Playing, feed: Feed, recording: Recording) -> None:
        self.faces: list[Face] = []
        self.url = str(recording.path)
        self.reconnects = 0
        self._playing = playing
        self._feed = feed
        self._recording = recording
        self._show_s = self._tick_s = 0.0
        self._said_over = self._said_slow = False
        self._guard = Guard("not shown after an error of ours")

    @property
    def coupling(self) -> Coupling:
        """What is played into; another one each time when it begins anew."""
        return self._playing.coupling

    @property
    def instrument(self) -> Instrument:
        """The instrument as it was recorded."""
        return self.coupling.instrument

    @property
    def link(self) -> Link:
        """The link to the board that was recorded."""
        return self.coupling.link

    async def connect(self, stop: asyncio.Event) -> None:
        """There is no rig to connect to."""

    async def run(self, stop: asyncio.Event) -> None:
        """Play until `stop` is set. Raises TapeError: what was recorded cannot be replayed."""
        while not stop.is_set():
            self._go_on(time.monotonic())
            await asyncio.sleep(PAUSE_S)
        log.info("ended; a replay has nothing to vent")

    def _go_on(self, now_s: float) -> None:
        for played in self._playing.advance(now_s):
            if isinstance(played, Entry):
                self._feed.note(played.kind, now_s, played.body)
            elif self._is_due(time.monotonic()):
                self._show(played, now_s)
        if now_s >= self._tick_s:
            self._tick_s = now_s + TICK_S
            for face in self.faces:
                self._guard(face.tick, now_s)
        self._say()

    def _is_due(self, now_s: float) -> bool:
        """Whether to tell of a sample: however fast it plays, of no more in a second than a rig sends."""
        if self._playing.speed > 1 and now_s < self._show_s:
            return False
        self._show_s = max(self._show_s, now_s - BEHIND_S) + 1 / SAMPLES_PER_S
        return True

    def _show(self, sample: Replayed, now_s: float) -> None:
        if self._feed.listeners:
            shifted = sample.measurement._replace(t_s=self._playing.live_s(sample.measurement.t_s))
            self._feed.note(Kind.MEASURED, now_s, pack(sample.raw, shifted))
        for face in self.faces:
            self._guard(face.on_sample, now_s)

    def _say(self) -> None:
        if self._playing.over and not self._said_over:
            self._said_over = True
            log.warning("the recording is over: from here on its values are stale")
            if remark := self._recording.remark():
                log.warning("%s", remark)
        if self._playing.slipped_s > SAY_SLIPPED_S and not self._said_slow:
            self._said_slow = True
            log.warning("this machine cannot play at speed %g: it plays slower", self._playing.speed)


def play(file: Path, configuration: Configuration, socket: Path | None, speed: float, again: bool) -> None:
    """Play a recording on the buses of a configuration until SIGTERM or Ctrl-C; see `serve`.

    Raises PneuforceError where it cannot start.
    """
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with replayable(file) as recording, log_to_stderr():
        if configuration.doubt:
            log.warning("%s", configuration.doubt)
        playing = Playing(lambda: (start_of(recording), _entries_of(recording)), speed, again)
        recorded = playing.coupling.instrument.settings.identity
        asyncio.run(_play(playing, recording, _as(recorded, configuration), Files(socket=socket)))


def _entries_of(recording: Recording) -> Iterator[Entry]:
    """What went into the instrument, and what its log told, in order of time."""
    events = (
        told(Kind.EVENT, facts["mono_s"], facts)
        for facts in recording.events()
        if isinstance(facts.get("mono_s"), float | int)
    )
    return merge(recording.entries(), events, key=attrgetter("t_s"))


async def _play(playing: Playing, recording: Recording, configuration: Configuration, files: Files) -> None:
    feed = Feed(("page",))
    player = Player(playing, feed, recording)
    faces = Faces(configuration, player, Played(playing), feed)
    faces.local.replay = Path(player.url).name
    await work_until_stopped(faces, files)


def _as(recorded: Identity, configuration: Configuration) -> Configuration:
    """The buses of a configuration, for the instrument that was recorded."""
    who = {"serial_number": recorded.serial_number, "calibration_date": recorded.calibration_date}
    own = configuration.identity.model_copy(update=who)
    return configuration.model_copy(update={"identity": own})
