"""Process of `pneuforce replay --config`, which serves a recording on the buses instead of a rig."""

from __future__ import annotations

import asyncio
import logging
import sys
import time
from collections.abc import Iterator
from heapq import merge
from operator import attrgetter
from pathlib import Path

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Identity
from pneuforce.instrument.core.state import STATE_LOGGER
from pneuforce.instrument.recording.broadcaster import EntryBroadcaster
from pneuforce.instrument.recording.paced_replay import PacedReplay, ReplayStart
from pneuforce.instrument.recording.reader import MAX_TIME_S, Recording
from pneuforce.instrument.recording.replay import ReplayedSample
from pneuforce.instrument.recording.replay_source import ReplaySource
from pneuforce.instrument.rig.link import Link
from pneuforce.instrument.service.host.command_gaps import CommandGaps
from pneuforce.instrument.service.host.host import TICK_S
from pneuforce.instrument.service.host.loop import OutputChannel
from pneuforce.instrument.service.replay_verification import initial_session, open_replayable
from pneuforce.instrument.service.serve import SWITCH_INTERVAL_S, Servers, ServiceFiles, run_until_stopped
from pneuforce.instrument.service.stderr_log import log_to_stderr
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, json_entry
from pneuforce.instrument.stream.sample_record import pack
from pneuforce.protocol.frames import SAMPLES_PER_S
from pneuforce.support.call_guard import CallGuard

log = logging.getLogger(STATE_LOGGER)

PAUSE_S = 0.002
MAX_CATCH_UP_S = 0.02  #: after a delay, missed samples of up to this time are shown at a higher rate
WARN_LAG_S = 1.0


class ReplayHost:
    """Loop that calls the output channels for recorded samples, as a host does for live samples."""

    def __init__(self, replay: PacedReplay, broadcaster: EntryBroadcaster, recording: Recording) -> None:
        self.channels: list[OutputChannel] = []
        self.url = str(recording.path)
        self.reconnects = 0
        self.command_gaps = CommandGaps()  # a replay sends no commands
        self._replay = replay
        self._broadcaster = broadcaster
        self._recording = recording
        self._next_sample_s = self._next_tick_s = 0.0
        self._end_logged = self._lag_logged = False
        self._guard = CallGuard("sample or tick of the replay not shown after an internal error")

    @property
    def session(self) -> Session:
        """Return the session of the replay. Each repetition uses a new session."""
        return self._replay.session

    @property
    def instrument(self) -> Instrument:
        """Return the instrument of the replayed session."""
        return self.session.instrument

    @property
    def link(self) -> Link:
        """Return the link of the replayed session."""
        return self.session.link

    async def connect(self, stop: asyncio.Event) -> None:
        """Do nothing: there is no rig."""

    async def run(self, stop: asyncio.Event) -> None:
        """Replay until `stop` is set. Raises StreamError if an entry cannot be replayed."""
        while not stop.is_set():
            self._advance(time.monotonic())
            await asyncio.sleep(PAUSE_S)
        log.info("ended; a replay does not vent")

    def end_at_once(self) -> None:
        """Do nothing, because a replay ends without a wait."""

    def _advance(self, now_s: float) -> None:
        for replayed in self._replay.advance(now_s):
            if isinstance(replayed, StreamEntry):
                self._broadcaster.record(replayed.kind, now_s, replayed.body)
            elif self._is_due(time.monotonic()):
                self._show(replayed, now_s)
        if now_s >= self._next_tick_s:
            self._next_tick_s = now_s + TICK_S
            for channel in self.channels:
                self._guard(channel.tick, now_s)
        self._log_changes()

    def _is_due(self, now_s: float) -> bool:
        """Return True if the next sample is shown.

        If the speed is above 1, samples are skipped, so that the buses receive no more samples per second
        than from a rig.
        """
        if self._replay.speed > 1 and now_s < self._next_sample_s:
            return False
        self._next_sample_s = max(self._next_sample_s, now_s - MAX_CATCH_UP_S) + 1 / SAMPLES_PER_S
        return True

    def _show(self, sample: ReplayedSample, now_s: float) -> None:
        if self._broadcaster.subscribers:
            t_s = self._replay.clock_time_s(sample.measurement.t_s)
            shifted = sample.measurement._replace(t_s=t_s)
            self._broadcaster.record(EntryKind.SAMPLE, now_s, pack(sample.raw, shifted))
        for channel in self.channels:
            self._guard(channel.on_sample, now_s)

    def _log_changes(self) -> None:
        if self._replay.finished and not self._end_logged:
            self._end_logged = True
            log.warning("end of the recording: its values are stale from now on")
            if remark := self._recording.remark():
                log.warning("%s", remark)
        if self._replay.total_lag_s > WARN_LAG_S and not self._lag_logged:
            self._lag_logged = True
            log.warning("this machine is too slow for speed %g; the replay runs slower", self._replay.speed)


def serve_replay(
    file: Path, configuration: Configuration, files: ServiceFiles, speed: float, repeat: bool
) -> None:
    """Replay a recording on the buses of a configuration until SIGTERM or Ctrl-C; see `serve`.

    Raises PneuforceError if the replay cannot start.
    """
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with open_replayable(file) as recording, log_to_stderr():
        if configuration.warning:
            log.warning("%s", configuration.warning)
        replay = PacedReplay(replay_start(recording), speed, repeat)
        identity = replay.session.instrument.settings.identity
        settings = _with_identity(configuration, identity)
        asyncio.run(_serve_replay(replay, recording, settings, files))


def replay_start(recording: Recording) -> ReplayStart:
    """Return the function that starts a replay of the recording at its beginning."""
    return lambda: (initial_session(recording), _entries_of(recording))


def _entries_of(recording: Recording) -> Iterator[StreamEntry]:
    """Yield the inputs of the instrument and the records of its event log in order of time."""
    events = (
        json_entry(EntryKind.EVENT, facts["mono_s"], facts)
        for facts in recording.events()
        if isinstance(facts.get("mono_s"), float | int) and 0 <= facts["mono_s"] <= MAX_TIME_S
    )
    return merge(recording.entries(), events, key=attrgetter("t_s"))


async def _serve_replay(
    replay: PacedReplay, recording: Recording, configuration: Configuration, files: ServiceFiles
) -> None:
    broadcaster = EntryBroadcaster(("web",))
    host = ReplayHost(replay, broadcaster, recording)
    servers = Servers(configuration, host, ReplaySource(replay), broadcaster, files)
    servers.local.replay = Path(host.url).name
    await run_until_stopped(servers, files)


def _with_identity(configuration: Configuration, recorded: Identity) -> Configuration:
    """Return the configuration of the buses with the identity of the recorded instrument."""
    update = {"serial_number": recorded.serial_number, "calibration_date": recorded.calibration_date}
    identity = configuration.identity.model_copy(update=update)
    return configuration.model_copy(update={"identity": identity})
