"""Messages in order of publication, and the values that the broker has not confirmed yet.

Sparkplug requires QoS 0, so the broker confirms no message with values. The outbox keeps each value until the
broker has answered a later request: the broker processes the packets of a connection in order.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

from pneuforce.mqtt.change_filter import ChangeFilter
from pneuforce.mqtt.payload import encode_metrics
from pneuforce.mqtt.session import EdgeSession, SparkplugMessage, metrics_of
from pneuforce.mqtt.store import DeliveryStore
from pneuforce.registers.sparkplug import Value, unavailable_values

BATCH_RECORDS = 200  #: stored records that one message contains


class Outbox:
    """Values of the instrument on their way to the broker. All times are arguments."""

    def __init__(self, changes: ChangeFilter, store: DeliveryStore) -> None:
        self.messages: deque[SparkplugMessage] = deque()
        self.session: EdgeSession | None = None  #: None while there is no connection to the broker
        self.vent_result: str | None = None
        self.store = store
        self._changes = changes
        self._values: dict[str, Value] | None = None  # None while the instrument cannot be reached
        self._unconfirmed: deque[tuple[int, Mapping[str, Value]]] = deque()
        self._sent_through: int | None = None  # number of the last stored record in a sent message

    # ---- the instrument

    def on_values(self, values: dict[str, Value], now_s: float, utc_ms: int) -> None:
        """Publish the values that have changed, or store them if the broker cannot receive them now."""
        self._values = values
        session = self.session
        if session is not None and session.is_born and not session.device_is_born:
            self.messages += session.device_birth(values, utc_ms)
            self._on_birth(utc_ms)
        elif changes := self._changes.changes(values, now_s):
            self._publish(changes, utc_ms)

    def _publish(self, changes: Mapping[str, Value], utc_ms: int) -> None:
        if self.session is not None and self.session.device_is_born:
            self._unconfirmed.append((utc_ms, changes))
            metrics = encode_metrics(metrics_of(changes, utc_ms))
            self.messages.append(self.session.data(metrics, utc_ms))
        else:
            self.store.append([_stored(utc_ms, changes)])

    def on_instrument_lost(self, utc_ms: int) -> None:
        """Publish the death of the device, or store that its values are not available."""
        if self._values is None:
            return
        self._values = None
        self._changes.restart({})
        if self.session is not None and self.session.device_is_born:
            self.messages += self.session.device_death(utc_ms)
        else:
            self.store.append([_stored(utc_ms, unavailable_values())])

    # ---- the broker

    def birth(self, utc_ms: int) -> None:
        """Publish the births, after a connection or at the request of a host application."""
        assert self.session is not None
        self.messages += self.session.birth(self._values, self.vent_result, utc_ms)
        self._on_birth(utc_ms)

    def _on_birth(self, utc_ms: int) -> None:
        """Take all values as published. If the birth is lost, they are stored like other values."""
        self._changes.restart(self._values or {})
        if self._values is not None:
            self._unconfirmed.append((utc_ms, self._values))

    def on_vent_result(self, result: str, utc_ms: int) -> None:
        """Publish the answer to a vent."""
        self.vent_result = result
        if self.session is not None and self.session.is_born:
            self.messages.append(self.session.vent_result(result, utc_ms))

    def add_stored(self, utc_ms: int) -> None:
        """Add a message with the oldest stored records, if the host application can receive them."""
        if self.session is None or not self.session.device_is_born or not self.store.count:
            return
        if records := self.store.oldest(BATCH_RECORDS):
            metrics = b"".join(record.metrics for record in records)
            self.messages.append(self.session.data(metrics, utc_ms))
            self._sent_through = records[-1].number

    @property
    def unconfirmed_values(self) -> int:
        """Return the number of messages with current values that the broker has not confirmed."""
        return len(self._unconfirmed)

    @property
    def all_confirmed(self) -> bool:
        """Return True if the broker has confirmed all values, current and stored ones."""
        return not self._unconfirmed and self._sent_through is None

    def confirmed(self, values: int) -> None:
        """Forget the oldest unconfirmed `values`, and remove the stored records that were sent."""
        for _ in range(values):
            self._unconfirmed.popleft()
        if self._sent_through is not None:
            self.store.remove_through(self._sent_through)
            self._sent_through = None

    def disconnected(self) -> None:
        """End the session. Store all values that the broker may not have received."""
        self.session, self._sent_through = None, None
        self.messages.clear()
        self.store.append([_stored(*record) for record in self._unconfirmed])
        self._unconfirmed.clear()


def _stored(utc_ms: int, values: Mapping[str, Value]) -> tuple[int, bytes]:
    return utc_ms, encode_metrics(metrics_of(values, utc_ms), historical=True)
