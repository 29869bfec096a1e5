"""Replay of a recording at the pace of a clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.replay import ReplayedSample, replay_input
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, StreamError

MAX_ENTRIES_PER_CALL = 500  #: the buses wait about 20 ms while these entries are replayed
#: Function that returns the session at the start of the recording, and the recorded inputs and events in
#: order of time.
ReplayStart = Callable[[], tuple[Session, Iterator[StreamEntry]]]


class PacedReplay:
    """Replay that follows a clock.

    `t_s` is the present position in the recording, in recorded time. All entries up to `t_s` are replayed.
    On a slow machine, `t_s` falls behind the clock, and the age of a value is measured at `t_s`. The values
    therefore do not become stale because of a slow machine.
    """

    def __init__(self, start: ReplayStart, speed: float = 1.0, repeat: bool = False) -> None:
        """Start the replay. With `repeat`, the replay starts again after the last entry.

        Raises StreamError if the recording has no inputs.
        """
        self.speed = speed
        self.finished = False  #: True after the last entry was replayed
        self.total_lag_s = 0.0  #: total time by which a slow machine has delayed the replay
        self._start, self._repeat = start, repeat
        self._clock_start_s: float | None = None
        self._rewind()

    def _rewind(self) -> None:
        self.session, self._entries = self._start()
        self._next = next(self._entries, None)
        if self._next is None:
            raise StreamError("this recording has no inputs from the rig, so it cannot be replayed")
        self.t_s = self._recording_start_s = self._next.t_s

    def clock_time_s(self, t_s: float) -> float:
        """Return the time on the clock at which the recorded time `t_s` is replayed [s]."""
        return (self._clock_start_s or 0.0) + (t_s - self._recording_start_s) / self.speed

    def advance(self, now_s: float) -> Iterator[ReplayedSample | StreamEntry]:
        """Replay the entries that are due at `now_s`, at most MAX_ENTRIES_PER_CALL.

        Yields each measured sample and each event of the event log. Raises StreamError if an entry cannot be
        replayed.
        """
        if self._clock_start_s is None:
            self._clock_start_s = now_s
        due_s = self._recording_start_s + (now_s - self._clock_start_s) * self.speed
        for _ in range(MAX_ENTRIES_PER_CALL):
            if self._next is None or self._next.t_s > due_s:
                break
            self.t_s = self._next.t_s
            if self._next.kind is EntryKind.EVENT:
                yield self._next
            else:
                yield from replay_input(self.session, self._next)
            self._next = next(self._entries, None)
        if self._next is None:
            self._finish_or_repeat(due_s, now_s)
        elif self._next.t_s > due_s:
            self.t_s = max(self.t_s, due_s)
        else:
            self.total_lag_s += (due_s - self.t_s) / self.speed
            self._recording_start_s, self._clock_start_s = self.t_s, now_s

    def _finish_or_repeat(self, due_s: float, now_s: float) -> None:
        if self._repeat:
            self._rewind()
            self._clock_start_s = now_s
            return
        self.finished = True
        self.t_s = max(self.t_s, due_s)
        self.session.instrument.tick(self.t_s)  # makes the values stale, as if the rig were disconnected
