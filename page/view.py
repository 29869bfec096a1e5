"""What is known of the instrument, and what of it the browsers are to be told, and when."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from itertools import groupby
from typing import Any

from instrument.events.words import in_words
from instrument.tape.contacts import ContactRow, Contacts
from instrument.tape.entry import Entry, Kind
from instrument.tape.measured import unpack
from page.rates import Counted, with_rates
from page.streams import Message
from page.thinning import Point, Thinning, point_of

STATE_S = 0.2
OPEN_CONTACT_S = 1.0  #: how often a contact that goes on is told again
HISTORY_S = 60.0
PIECE_S = 0.5  #: of the history: what is new must not wait long behind one
MOST_CONTACTS = 50
MOST_POINTS = 6000
MOST_EVENTS = 50
SILENT_S = 1.0  #: the instrument says something each 50 ms; then its values are void

#: What of the snapshot the browsers show.
STATE = (
    "t_s",
    *("force_n", "force_std_n", "pressure_kpa", "radius_mm", "setpoint_kpa", "setpoint_requested_kpa"),
    *("force_limit_n", "state", "mode", "status", "faults", "lease_holder", "lease_left_s"),
    *("answer_sequence", "answer_state", "answer_result"),
)
NOT_YET = "The instrument was not reached yet."


class View:
    """Takes entries of the tape, and has messages for the browsers. Times are those of the host's clock."""

    def __init__(self) -> None:
        self.begun: Mapping[str, Any] = {}  #: what the instrument says of itself, empty until it was reached
        self.snapshot: Mapping[str, Any] | None = None  #: None where it is void
        self.why = NOT_YET  #: why the instrument's values are void, empty where they are not
        self._begun_s = 0.0
        self._outbox: list[Message] = []
        self._events: deque[Message] = deque(maxlen=MOST_EVENTS)
        self._state_due_s = self._contacts_due_s = -math.inf
        self._take: Mapping[Kind, Callable[[Entry], None]] = {
            Kind.BEGIN: self._begin,
            Kind.MEASURED: self._measured,
            Kind.EVENT: self._event,
            Kind.SNAPSHOT: self._snapshot,
            Kind.HEALTH: self._health,
            Kind.END: self._end,
        }
        self._forget()

    def _forget(self) -> None:
        self.snapshot = None
        self.health: Mapping[str, Any] = {}
        self._counted: Counted | None = None
        self._heard_s = -math.inf
        self._told: Mapping[str, Any] = {}
        self._thinning, self._contacts = Thinning(), Contacts(MOST_CONTACTS)
        self._told_contact = 0  # the number of the latest that was told
        self._history: deque[Point] = deque(maxlen=MOST_POINTS)
        self._new: list[Point] = []
        self._contacts_changed = True

    # ---- what comes in

    def take(self, entry: Entry) -> None:
        """Learn from one entry. Raises TapeError, struct.error where it is not what its kind says."""
        take = self._take.get(entry.kind)
        if take is not None:
            take(entry)

    def lose(self, why: str) -> None:
        """The instrument is gone: nothing of it may be shown any more. The first reason stands."""
        self._forget()
        if self.why in ("", NOT_YET):
            self._link(why)

    def _link(self, why: str) -> None:
        if why != self.why:
            self.why = why
            self._outbox.append(self._link_message())

    def _link_message(self) -> Message:
        return Message("link", {"up": not self.why, "why": self.why, "begun_s": self._begun_s})

    def _begin(self, entry: Entry) -> None:
        self._forget()
        self.begun, self._begun_s = entry.facts, entry.t_s

    def _end(self, entry: Entry) -> None:
        self.lose(f"The instrument has ended: {entry.facts.get('why', '')}.")

    def _measured(self, entry: Entry) -> None:
        measured = unpack(entry.body)
        shown = self._thinning.take(point_of(measured))
        self._new += shown
        self._history += shown
        self._contacts_changed |= self._contacts.take(measured)

    def _event(self, entry: Entry) -> None:
        message = Message("event", _told_of(entry.facts))
        self._events.append(message)
        self._outbox.append(message)

    def _snapshot(self, entry: Entry) -> None:
        self.snapshot = {"t_s": entry.t_s, **entry.facts}
        self._heard_s = entry.t_s
        self._link("")

    def _health(self, entry: Entry) -> None:
        now = Counted(entry.t_s, entry.facts)
        self.health = with_rates(self._counted, now)
        self._counted = now
        self._outbox.append(Message("health", self.health))

    # ---- what goes out

    def due(self, now_s: float) -> list[Message]:
        """What all browsers are to be told now; asked for 20 times a second."""
        if self.snapshot is not None and not now_s - self._heard_s <= SILENT_S:
            self.snapshot = None
            self._link("The instrument says nothing; it may be overloaded, or stopped.")
        messages, self._outbox = self._outbox, []
        return [*messages, *self._samples(), *self._state(now_s), *self._contacts_due(now_s)]

    def _samples(self) -> list[Message]:
        new, self._new = self._new, []
        return [_columns("samples", new)] if new else []

    def _state(self, now_s: float) -> list[Message]:
        now = self.snapshot
        if now is None or now is self._told:
            return []
        changed = any(now.get(name) != self._told.get(name) for name in ("state", "status", "faults"))
        if not changed and now_s < self._state_due_s:
            return []
        self._told, self._state_due_s = now, max(self._state_due_s + STATE_S, now_s)
        return [_state_message(now)]

    def _contacts_due(self, now_s: float) -> list[Message]:
        rows = self._contacts.rows
        going_on = bool(rows) and rows[-1].open and now_s >= self._contacts_due_s
        if not self._contacts_changed and not going_on:
            return []
        self._contacts_changed, self._contacts_due_s = False, now_s + OPEN_CONTACT_S
        changed = [row for row in rows if row.number >= self._told_contact]
        self._told_contact = rows[-1].number if rows else 0
        return [_contacts_message(changed)]

    def greeting(self) -> list[Message]:
        """What a browser is to be told that has just come; first what is shown in large."""
        state = [_state_message(self.snapshot)] if self.snapshot is not None else []
        health = [Message("health", self.health)] if self.health else []
        contacts = _contacts_message(self._contacts.rows)
        return [self._link_message(), *state, contacts, *self._events, *health]

    def history(self) -> list[Message]:
        """The last minute's samples, in pieces, the latest first."""
        since_s = self._history[-1].t_s - HISTORY_S if self._history else 0.0
        recent = (point for point in self._history if point.t_s >= since_s)
        pieces = [list(piece) for _, piece in groupby(recent, lambda point: point.t_s // PIECE_S)]
        return [_columns("history", piece) for piece in reversed(pieces)]


def _state_message(snapshot: Mapping[str, Any]) -> Message:
    shown = {name: snapshot[name] for name in STATE if name in snapshot}
    return Message("state", {name: round(v, 4) if isinstance(v, float) else v for name, v in shown.items()})


def _columns(event: str, points: list[Point]) -> Message:
    return Message(
        event,
        {
            "t_s": [round(p.t_s, 4) for p in points],
            "force_n": [_short(p.force_n) for p in points],
            "std_n": [_short(p.std_n) for p in points],
            "pressure_kpa": [_short(p.pressure_kpa) for p in points],
            "initial_kpa": [_short(p.initial_kpa) for p in points],
            "in_contact": [int(p.in_contact) for p in points],
        },
    )


def _short(value: float) -> float | None:
    """As much as a plot can show; null for what JSON has no number for."""
    return round(value, 3) if math.isfinite(value) else None


def _contacts_message(rows: list[ContactRow]) -> Message:
    """Rows that take the place of all from the first one's number on; none where there are no contacts."""
    return Message("contacts", {"rows": [_shortened(row) for row in rows]})


def _shortened(row: ContactRow) -> dict[str, Any]:
    return {
        name: _short(value) if isinstance(value, float) else value for name, value in row._asdict().items()
    }


def _told_of(facts: Mapping[str, Any]) -> dict[str, str]:
    who, verdict = (str(facts.get(name, "")) for name in ("who", "verdict"))
    text = ": ".join(filter(None, (who, in_words(facts), verdict)))
    return {"at": str(facts.get("at", "")), "kind": str(facts.get("kind", "")), "text": text}
