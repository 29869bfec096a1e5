"""The sieve: repetitions and floods are counted, so that years of a PLC and a hostile peer fit a disk."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from instrument.events.record import Facts, Moment, Record, written

SILENT_S = 60.0  #: a repetition that stays away for so long has ended
LONG_S = 3600.0  #: one that does not end is told so often
BURST = 200.0  #: records of one peer and one grade at once
#: And per second. Who is refused without end may not fill a disk within a season.
PER_S = {"vent": 20.0, "accepted": 20.0, "refused": 1.0}
MOST_LINES = 32  #: different writes of one peer that are recognised when they come again
MOST_PEERS = 64  #: with a memory of their own at once; those beyond share one

Peer = tuple[str, str]
OTHERS: Peer = ("others", "")


class Deed(NamedTuple):
    """What a peer did: a write, or a request that was refused before it was one."""

    facts: Facts
    line: Hashable  #: what it is about: a deed on the same line with the same `key` is a repetition
    key: Hashable
    grade: str  #: vent, accepted or refused; each has a budget of its own
    changed: bool = False  #: what changes something is never a repetition


@dataclass(slots=True)
class Tally:
    """Counts what gets no record of its own."""

    kind: str
    last: Moment
    facts: Facts
    key: Hashable = None
    grade: str = ""
    times: int = 0
    since: Moment | None = None

    def add(self, at: Moment, times: int = 1) -> None:
        """One more, or several."""
        self.since = self.since or at
        self.times += times
        self.last = at

    def told(self) -> list[Facts]:
        """What was counted, if anything; counting begins anew."""
        if self.since is None:
            return []
        of = {name: fact for name, fact in self.facts.items() if name != "who"}
        span = {"since": written(self.since), "until": written(self.last)}
        told = {"kind": self.kind, "who": self.facts.get("who"), "times": self.times, **span, "of": of}
        self.times, self.since = 0, None
        return [told]

    def is_due(self, at: Moment) -> bool:
        """Whether it has gone on for long enough to be told."""
        return self.since is not None and at.mono_s - self.since.mono_s > LONG_S

    def is_silent(self, at: Moment) -> bool:
        """Whether nothing came for so long that it has ended."""
        return at.mono_s - self.last.mono_s > SILENT_S


@dataclass(slots=True)
class Budget:
    """So many at once, and so many per second."""

    per_s: float
    left: float = BURST
    _at_s: float = 0.0

    def spend(self, now_s: float) -> bool:
        """Whether there was one left."""
        self._refill(now_s)
        if self.left < 1.0:
            return False
        self.left -= 1.0
        return True

    def is_full(self, now_s: float) -> bool:
        """Whether it is what a new one would be."""
        self._refill(now_s)
        return self.left >= BURST

    def _refill(self, now_s: float) -> None:
        self.left = min(BURST, self.left + self.per_s * max(0.0, now_s - self._at_s))
        self._at_s = now_s


@dataclass(slots=True)
class _Memory:
    """What is remembered of one peer, or of those that share it under one name."""

    shared_as: str = ""
    lines: dict[Hashable, Tally] = field(default_factory=dict)  # the least recent first
    held_back: dict[Hashable, Tally] = field(default_factory=dict)
    budgets: dict[str, Budget] = field(default_factory=dict)

    def sift(self, deed: Deed, at: Moment) -> list[Record]:
        before = self.lines.pop(deed.line, None)
        if before is not None and before.key == deed.key and not deed.changed:
            self.lines[deed.line] = before
            before.add(at)
            return []
        self.lines[deed.line] = Tally("repeated", at, deed.facts, deed.key, deed.grade)
        ended = [before] if before else []
        if len(self.lines) > MOST_LINES:
            ended.append(self.lines.pop(next(iter(self.lines))))
        records = [r for tally in ended for facts in tally.told() for r in self._let(facts, tally.grade, at)]
        return [*records, *self._let(deed.facts, deed.grade, at)]

    def _let(self, facts: Facts, grade: str, at: Moment) -> Iterator[Record]:
        """The record where the budget has one left; else it is counted."""
        budget = self.budgets.get(grade) or self.budgets.setdefault(grade, Budget(PER_S[grade]))
        if budget.spend(at.mono_s):
            yield Record(at, facts, minor=grade == "refused")
            return
        held = self.held_back.setdefault(grade, Tally("held_back", at, facts))
        held.facts = facts
        if self.shared_as:
            held.facts = {**facts, "who": self.shared_as, "last_who": facts.get("who")}
        held.add(at, facts.get("times", 1))

    def due(self, at: Moment) -> Iterator[Record]:
        for tallies in (self.lines, self.held_back):
            for line, tally in list(tallies.items()):
                silent = tally.is_silent(at)
                if silent or tally.is_due(at):
                    yield from (Record(at, facts) for facts in tally.told())
                if silent:
                    del tallies[line]

    def is_blank(self, now_s: float) -> bool:
        """Whether it is as good as a new one: who falls silent for a moment gets no second burst by that."""
        full = all(budget.is_full(now_s) for budget in self.budgets.values())
        return full and not self.lines and not self.held_back


class Sieve:
    """Lets pass what is new; counts the rest and tells how much it was."""

    def __init__(self) -> None:
        self._memories: dict[Peer, _Memory] = {}

    def sift(self, peer: Peer, deed: Deed, at: Moment) -> list[Record]:
        """Records that a peer's deed calls for now: often none."""
        if peer not in self._memories and len(self._memories) >= MOST_PEERS:
            deed = deed._replace(line=(peer, deed.line))  # what two of them do is no repetition
            peer = OTHERS
        memory = self._memories.get(peer)
        if memory is None:
            memory = self._memories[peer] = _Memory(OTHERS[0] if peer == OTHERS else "")
        return memory.sift(deed, at)

    def due(self, at: Moment) -> list[Record]:
        """Records of what was counted and has ended, or goes on for an hour; to be asked now and then."""
        records = [record for memory in self._memories.values() for record in memory.due(at)]
        self._memories = {peer: m for peer, m in self._memories.items() if not m.is_blank(at.mono_s)}
        return records

    def rest(self, at: Moment) -> list[Record]:
        """Records of all that is still counted: the end."""
        tallies = [
            tally
            for memory in self._memories.values()
            for tally in (*memory.lines.values(), *memory.held_back.values())
        ]
        return [Record(at, facts) for tally in tallies for facts in tally.told()]
