"""State of the instrument for the browsers, and the schedule of the messages to the browsers."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from itertools import dropwhile, groupby, takewhile
from typing import Any

from pneuforce.instrument.recording.contacts import ContactHistory, ContactRow, tube_time_constant_of
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry
from pneuforce.instrument.stream.sample_record import unpack
from pneuforce.web.decimation import LiveDecimator, LivePoint, live_point
from pneuforce.web.event_stream import SseMessage
from pneuforce.web.event_texts import event_message
from pneuforce.web.rates import HealthReading, with_rates

STATE_PERIOD_S = 0.2
OPEN_CONTACT_PERIOD_S = 1.0  #: period of the messages about a contact in progress
HISTORY_S = 60.0
HISTORY_PART_S = 0.5  #: duration of one history message; a longer message would delay new messages
MAX_CONTACTS = 50
MAX_POINTS = 6000  #: 60 s at 100 points per second
MAX_EVENTS = 50
#: The instrument sends a snapshot each 50 ms. Without a snapshot for this time, the values are invalid.
SNAPSHOT_TIMEOUT_S = 1.0
STATE_DIGITS = 4  #: decimals of the numbers in a state message

#: Quantities of the snapshot that the browsers use, and `vent_requested_s`.
STATE = (
    "t_s",
    *("force_n", "force_std_n", "pressure_kpa", "radius_mm", "setpoint_kpa", "setpoint_requested_kpa"),
    "force_uncompensated_n",
    *("force_lower_range_limit_n", "force_limit_n", "state", "mode", "status", "faults"),
    "maintenance_causes",
    *("proof_test_age_s", "balloon_id", "inflation_count"),
    *("lease_holder", "lease_left_s", "answer_sequence", "answer_state", "answer_result"),
    "vent_requested_s",
)
#: Quantities whose change is sent at once.
URGENT = ("state", "status", "faults")
NOT_REACHED = "The instrument has not been reached yet."


class BrowserFeed:
    """Converter from stream entries to messages for the browsers.

    All times are times of the monotonic clock of the host process.
    """

    def __init__(self) -> None:
        self.header: Mapping[str, Any] = {}  #: the stream header; empty until the instrument is reached
        self.snapshot: Mapping[str, Any] | None = None  #: None while the values are invalid
        self.down_reason = NOT_REACHED  #: why the values are invalid; empty while the values are valid
        self._started_s = 0.0
        self._outbox: list[SseMessage] = []
        self._events: deque[dict[str, str]] = deque(maxlen=MAX_EVENTS)
        self._state_due_s = self._contacts_due_s = -math.inf
        self._handlers: Mapping[EntryKind, Callable[[StreamEntry], None]] = {
            EntryKind.HEADER: self._on_header,
            EntryKind.SAMPLE: self._on_sample,
            EntryKind.EVENT: self._on_event,
            EntryKind.WRITE: self._on_write,
            EntryKind.SNAPSHOT: self._on_snapshot,
            EntryKind.HEALTH: self._on_health,
            EntryKind.END: self._on_end,
        }
        self._reset()
        self._forget_contacts()

    def _reset(self) -> None:
        self.snapshot = None
        self.health: Mapping[str, Any] = {}
        self._health_reading: HealthReading | None = None
        self._snapshot_s = -math.inf
        self._vent_requested_s = 0.0  # time of the last vent request of any client; 0 if there was none
        self._sent_snapshot: Mapping[str, Any] = {}
        self._decimator = LiveDecimator()
        self._history: deque[LivePoint] = deque(maxlen=MAX_POINTS)
        self._new_points: list[LivePoint] = []

    def _forget_contacts(self) -> None:
        self._contacts = ContactHistory(MAX_CONTACTS, tube_time_constant_of(self.header))
        self._sent_contacts: list[ContactRow] = []
        self._contacts_changed = True

    # ---- entries from the instrument

    def process(self, entry: StreamEntry) -> None:
        """Update the state from one entry.

        Raises StreamError or struct.error if the body does not match the kind of the entry.
        """
        handler = self._handlers.get(entry.kind)
        if handler is not None:
            handler(entry)

    def disconnected(self, reason: str) -> None:
        """Discard the values of the instrument, but no contact. If a reason is already set, keep it."""
        self._reset()
        if self.down_reason in ("", NOT_REACHED):
            self._set_link(reason)

    def _set_link(self, down_reason: str) -> None:
        if down_reason != self.down_reason:
            self.down_reason = down_reason
            self._outbox.append(self._link_message())

    def _link_message(self) -> SseMessage:
        utc_us = self.header.get("utc_us")
        return SseMessage(
            "link",
            {
                "up": not self.down_reason,
                "reason": self.down_reason,
                "started_s": self._started_s,
                "utc_offset_s": None if utc_us is None else utc_us / 1e6 - self._started_s,
            },
        )

    def _on_header(self, entry: StreamEntry) -> None:
        is_same_run = bool(self.header) and entry.t_s == self._started_s
        self.header, self._started_s = entry.json_body, entry.t_s
        self._events.clear()
        self._reset()
        if not is_same_run:
            self._forget_contacts()

    def _on_end(self, entry: StreamEntry) -> None:
        self.disconnected(f"The instrument has stopped: {entry.json_body.get('why', '')}.")

    def _on_sample(self, entry: StreamEntry) -> None:
        record = unpack(entry.body)
        points = self._decimator.add(live_point(record))
        self._new_points += points
        self._history += points
        self._contacts_changed |= self._contacts.add_sample(record)

    def _on_event(self, entry: StreamEntry) -> None:
        message = event_message(entry.json_body)
        self._events.append(message)
        self._outbox.append(SseMessage("event", message))

    def add_earlier_events(self, logged: list[dict[str, str]]) -> None:
        """Put events of the event log before those received since the last header, and send the list again.

        The first of the received events can be in the log, too.
        """
        later = takewhile(lambda message: message not in logged, reversed(self._events))
        self._events = deque([*logged, *reversed(list(later))], MAX_EVENTS)
        self._outbox.append(self._events_message())

    def _events_message(self) -> SseMessage:
        """Return a message with the latest events, which replace the list of the browser."""
        return SseMessage("events", {"rows": list(self._events)})

    def _on_write(self, entry: StreamEntry) -> None:
        _, _, values = entry.json_body
        if values.get("mode") == "vent":
            self._vent_requested_s = entry.t_s

    def _on_snapshot(self, entry: StreamEntry) -> None:
        times = {"t_s": entry.t_s, "vent_requested_s": self._vent_requested_s}
        self.snapshot = {**times, **entry.json_body}
        self._snapshot_s = entry.t_s
        self._set_link("")

    def _on_health(self, entry: StreamEntry) -> None:
        reading = HealthReading(entry.t_s, entry.json_body)
        self.health = with_rates(self._health_reading, reading)
        self._health_reading = reading
        self._outbox.append(SseMessage("health", self.health))

    # ---- messages to the browsers

    def due_messages(self, now_s: float) -> list[SseMessage]:
        """Return the messages that are due for all browsers. The server calls this 20 times per second."""
        if self.snapshot is not None and not now_s - self._snapshot_s <= SNAPSHOT_TIMEOUT_S:
            self.snapshot = None
            self._set_link(
                f"The instrument has sent nothing for {SNAPSHOT_TIMEOUT_S:g} s: it is stopped or overloaded."
            )
        messages, self._outbox = self._outbox, []
        return [*messages, *self._samples_due(), *self._state_due(now_s), *self._contacts_due(now_s)]

    def _samples_due(self) -> list[SseMessage]:
        points, self._new_points = self._new_points, []
        return [_samples_message("samples", points)] if points else []

    def _state_due(self, now_s: float) -> list[SseMessage]:
        snapshot = self.snapshot
        if snapshot is None or snapshot is self._sent_snapshot:
            return []
        is_urgent = any(snapshot.get(name) != self._sent_snapshot.get(name) for name in URGENT)
        if not is_urgent and now_s < self._state_due_s:
            return []
        self._sent_snapshot, self._state_due_s = snapshot, max(self._state_due_s + STATE_PERIOD_S, now_s)
        return [_state_message(snapshot)]

    def _contacts_due(self, now_s: float) -> list[SseMessage]:
        rows = self._contacts.rows
        in_progress_due = bool(rows) and rows[-1].open and now_s >= self._contacts_due_s
        if not self._contacts_changed and not in_progress_due:
            return []
        self._contacts_changed, self._contacts_due_s = False, now_s + OPEN_CONTACT_PERIOD_S
        changed = list(dropwhile(self._sent_contacts.__contains__, rows))
        self._sent_contacts = rows
        return [_contacts_message(changed)] if changed or not rows else []

    def initial_messages(self) -> list[SseMessage]:
        """Return the messages for a new browser. The measured values precede contacts and events."""
        state = [_state_message(self.snapshot)] if self.snapshot is not None else []
        health = [SseMessage("health", self.health)] if self.health else []
        contacts = _contacts_message(self._contacts.rows)
        return [self._link_message(), *state, contacts, self._events_message(), *health]

    def history_messages(self) -> list[SseMessage]:
        """Return the samples of the last 60 s in parts of 0.5 s, the latest part first."""
        since_s = self._history[-1].t_s - HISTORY_S if self._history else 0.0
        recent = (point for point in self._history if point.t_s >= since_s)
        parts = [list(part) for _, part in groupby(recent, lambda point: point.t_s // HISTORY_PART_S)]
        return [_samples_message("history", part) for part in reversed(parts)]


def _state_message(snapshot: Mapping[str, Any]) -> SseMessage:
    values = {name: snapshot[name] for name in STATE if name in snapshot}
    return SseMessage(
        "state", {name: round(v, STATE_DIGITS) if isinstance(v, float) else v for name, v in values.items()}
    )


def _samples_message(event: str, points: list[LivePoint]) -> SseMessage:
    return SseMessage(
        event,
        {
            "t_s": [round(p.t_s, 4) for p in points],
            "force_n": [_rounded(p.force_n) for p in points],
            "std_n": [_rounded(p.std_n) for p in points],
            "lower_limit_n": [_rounded(p.lower_limit_n) for p in points],
            "pressure_kpa": [_rounded(p.pressure_kpa) for p in points],
            "baseline_kpa": [_rounded(p.baseline_kpa) for p in points],
            "in_contact": [int(p.in_contact) for p in points],
            "board_state": [p.state for p in points],
        },
    )


def _rounded(value: float) -> float | None:
    """Return a value with three decimals, which are enough for the plots; None for NaN and infinity."""
    return round(value, 3) if math.isfinite(value) else None


def _contacts_message(rows: list[ContactRow]) -> SseMessage:
    """Return a message with contact rows.

    The browser keeps its rows with lower numbers and replaces all others. An empty list clears the table.
    """
    return SseMessage("contacts", {"rows": [_row_data(row) for row in rows]})


def _row_data(row: ContactRow) -> dict[str, Any]:
    return {
        name: _rounded(value) if isinstance(value, float) else value for name, value in row._asdict().items()
    }
