"""The witness: between the buses and the instrument, puts down what was asked and what happened."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from instrument.commands import CommandBlock
from instrument.coupling import Coupling
from instrument.events.changes import Seen, changes
from instrument.events.record import Facts, Moment, Record
from instrument.events.sieve import Deed, Sieve
from instrument.guard import Guard
from instrument.lease import Peer
from instrument.refusal import Refusal
from instrument.snapshot import Snapshot, standing, state_of

log = logging.getLogger("pneuforce")

TELL_S = 1.0  #: how often the sieve is asked for what is due
ALARM_OVER_S = 1.0  #: a force that hovers at its limit is one alarm


class Journal(Protocol):
    """What keeps the records."""

    @property
    def trouble(self) -> str:
        """Why it cannot just now, empty where it can."""
        ...

    def put(self, record: Record) -> None:
        """Take a record; never waits, never raises."""
        ...


class Nowhere:
    """The journal of an instrument that keeps none."""

    trouble = ""

    def put(self, record: Record) -> None:
        """Forget it."""


class Witness:
    """The instrument as the buses see it, each write put down with old and new value and verdict.

    It is told of samples and of the time as a face is, and puts down what the instrument does by itself.
    """

    def __init__(
        self,
        coupling: Coupling,
        journal: Journal,
        utc_us: Callable[[], int] = lambda: time.time_ns() // 1000,
    ) -> None:
        self._coupling = coupling
        self._instrument = coupling.instrument
        self._journal = journal
        self._utc_us = utc_us
        self._sieve = Sieve()
        self._seen = Seen(board=None, faults=(), state="boot", zero_kpa=None, force_alarm=False)
        self._alarm_until_s = 0.0
        self._tell_s = 0.0
        self._guarded = Guard("a write was not put down, after an error of ours")
        self._ended = False
        self._orders: dict[str, CommandBlock] = {}  # commands whose answer is to come, by who gave them

    # ---- as a source

    @property
    def can_down(self) -> bool:
        """Whether the CAN bus is down, as the instrument was told."""
        return self._instrument.can_down

    @can_down.setter
    def can_down(self, down: bool) -> None:
        """Tell the instrument of it."""
        self._instrument.can_down = down

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:
        """One instant, as `peer` sees it."""
        return self._instrument.snapshot(peer, now_s)

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> Refusal:
        """Have one request carried out, and put it down."""
        before = self._guarded(standing, self._instrument, peer, now_s) or {}
        refusal = self._coupling.write(peer, values, now_s)
        self._guarded(self._put_down, peer, values, before, refusal, now_s)
        return refusal

    def _put_down(
        self,
        peer: Peer,
        values: Mapping[str, Any],
        before: Mapping[str, Any],
        refusal: Refusal,
        now_s: float,
    ) -> None:
        old_and_new = {name: (before.get(name), value) for name, value in values.items()}
        accepted = refusal is Refusal.NONE
        verdict = "accepted" if accepted else str(refusal)
        vent = values.get("mode") == "vent"
        deed = Deed(
            facts={"kind": "write", "who": _who(peer), "values": old_and_new, "verdict": verdict}
            | ({"vented": True} if vent and not accepted else {}),
            line=tuple(values),
            key=(tuple(values.values()), verdict),
            grade="vent" if vent else "accepted" if accepted else "refused",
            changed=accepted and any(_differs(name, *both) for name, both in old_and_new.items()),
        )
        self._put(self._sieve.sift(peer, deed, self._at(now_s)))
        if accepted and _differs("command_sequence", *old_and_new.get("command_sequence", (0, 0))):
            self._orders[_who(peer)] = self._instrument.commands(peer)
        self._look(now_s)

    def master_lost(self, now_s: float) -> None:
        """Have the instrument do without its CAN master."""
        self._coupling.master_lost(now_s)
        self._look(now_s)

    def master_back(self, now_s: float) -> None:
        """Let its loss be cleared from now on."""
        self._coupling.master_back(now_s)

    def refused(self, peer: Peer, request: bytes, why: str, now_s: float) -> None:
        """Put down a request to write that did not get as far as the instrument."""
        facts = {"kind": "request", "who": _who(peer), "request": request.hex(" "), "verdict": why}
        deed = Deed(facts, line=request, key=why, grade="refused")
        self._put(self._sieve.sift(peer, deed, self._at(now_s)))

    # ---- as a face

    def on_sample(self, now_s: float) -> None:
        """Look at the instrument."""
        self._look(now_s)

    def tick(self, now_s: float) -> None:
        """Look at the instrument, tell it how the journal is, and put down what was counted."""
        self._instrument.log_down = bool(self._journal.trouble)
        self._look(now_s)
        if now_s >= self._tell_s:
            self._tell_s = now_s + TELL_S
            self._put(self._sieve.due(self._at(now_s)))

    # ---- begin and end

    def begin(self, facts: Facts, now_s: float) -> None:
        """Put down that the instrument starts, and what it is."""
        self._put([Record(self._at(now_s), {"kind": "start", **facts})])

    def end(self, why: str, now_s: float) -> None:
        """Put down what is still counted, and that the instrument ends; once is enough."""
        if self._ended:
            return
        self._ended = True
        self._look(now_s)
        at = self._at(now_s)
        self._put([*self._sieve.rest(at), Record(at, {"kind": "stop", "why": why})])

    # ---- looking

    def _look(self, now_s: float) -> None:
        seen = self._sight(now_s)
        if seen != self._seen:
            at = self._at(now_s)
            self._put([Record(at, facts) for facts in changes(self._seen, seen)])
            self._seen = seen
        if self._orders:
            self._look_for_answers(now_s)

    def _sight(self, now_s: float) -> Seen:
        own = self._instrument
        hello, zero = own.hello, own.chain.zero
        if own.force_limit_passed:
            self._alarm_until_s = now_s + ALARM_OVER_S
        return Seen(
            board=(hello.board, hello.serial, hello.firmware) if hello else None,
            faults=tuple(own.faults),
            state=state_of(own, own.link_lost(now_s)),
            zero_kpa=zero.zero_kpa if zero.taken else None,
            force_alarm=now_s < self._alarm_until_s,
        )

    def _look_for_answers(self, now_s: float) -> None:
        for who, block in list(self._orders.items()):
            if block.answer_state != "busy":
                del self._orders[who]
                result = "done" if block.answer_result is Refusal.NONE else str(block.answer_result)
                facts = {"kind": "answer", "who": who, "command": block.code, "verdict": result}
                self._put([Record(self._at(now_s), facts)])

    def _at(self, now_s: float) -> Moment:
        return Moment(self._utc_us(), now_s)

    def _put(self, records: list[Record]) -> None:
        for record in records:
            self._journal.put(record)


def _who(peer: Peer) -> str:
    return " ".join(peer).strip()


def _differs(name: str, old: Any, new: Any) -> bool:
    """Whether a write changes a quantity; the key of a command is used up each time, and changes nothing."""
    return name != "command_key" and old != new
