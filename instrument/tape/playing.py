"""Playing: a recording at the pace of a clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from instrument.coupling import Coupling
from instrument.tape.entry import Entry, Kind, TapeError
from instrument.tape.replay import Replayed, feed

MOST_AT_ONCE = 500  #: entries, some 20 ms of work: the buses wait as long
#: A coupling as at the recording's begin, and what went into it from then on, events of the log between.
Begin = Callable[[], tuple[Coupling, Iterator[Entry]]]


class Playing:
    """A replay that keeps the pace of a clock. The recorded time stands at `t_s`, and all until then is done.

    Where the machine cannot keep the pace the recorded time slips: no value is ever older than it says.
    """

    def __init__(self, begin: Begin, speed: float = 1.0, again: bool = False) -> None:
        """`again`: at its end the recording begins anew. Raises TapeError: there is nothing to play."""
        self.speed = speed
        self.over = False  #: all has been played
        self.slipped_s = 0.0  #: how long it has not kept the pace, by the clock
        self._begin, self._again = begin, again
        self._live_s: float | None = None
        self._rewind()

    def _rewind(self) -> None:
        self.coupling, self._entries = self._begin()
        self._next = next(self._entries, None)
        if self._next is None:
            raise TapeError("nothing came from the rig in this recording: there is nothing to play")
        self.t_s = self._from_s = self._next.t_s

    def live_s(self, t_s: float) -> float:
        """When a recorded moment is played, by the clock [s]."""
        return (self._live_s or 0.0) + (t_s - self._from_s) / self.speed

    def advance(self, now_s: float) -> Iterator[Replayed | Entry]:
        """Play what is due at `now_s`, not all of it where it is much.

        Yields each sample as it is measured, and each event of the log. Raises TapeError.
        """
        if self._live_s is None:
            self._live_s = now_s
        due_s = self._from_s + (now_s - self._live_s) * self.speed
        for _ in range(MOST_AT_ONCE):
            if self._next is None or self._next.t_s > due_s:
                break
            self.t_s = self._next.t_s
            if self._next.kind is Kind.EVENT:
                yield self._next
            else:
                yield from feed(self.coupling, self._next)
            self._next = next(self._entries, None)
        if self._next is None:
            self._end(due_s, now_s)
        elif self._next.t_s > due_s:
            self.t_s = max(self.t_s, due_s)
        else:
            self.slipped_s += (due_s - self.t_s) / self.speed
            self._from_s, self._live_s = self.t_s, now_s

    def _end(self, due_s: float, now_s: float) -> None:
        """From here on nothing comes any more, as from a rig that has gone; or all comes again."""
        if self._again:
            self._rewind()
            self._live_s = now_s
            return
        self.over = True
        self.t_s = max(self.t_s, due_s)
        self.coupling.instrument.tick(self.t_s)
