"""Session of Sparkplug B during one MQTT connection: births, data, deaths, and their sequence numbers.

The session performs no I/O. Each method returns the messages to publish, in order.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import NamedTuple

from pneuforce.mqtt.payload import MetricValue, encode_metrics, encode_payload
from pneuforce.mqtt.topics import SparkplugTopics
from pneuforce.registers.sparkplug import (
    BIRTH_NUMBER,
    METRICS,
    REBIRTH,
    VENT,
    VENT_RESULT,
    Datatype,
    Value,
)

SEQUENCE_NUMBERS = BIRTH_NUMBERS = 256

_BY_NAME = {metric.name: metric for metric in METRICS}


class SparkplugMessage(NamedTuple):
    """Message to publish. Sparkplug requires QoS 0, except for the will."""

    topic: str
    payload: bytes
    qos: int = 0


class EdgeSession:
    """State of the edge node and of its device, as a host application knows it."""

    def __init__(self, topics: SparkplugTopics, birth_number: int, primary_host: str = "") -> None:
        """Create the session before the connection. `birth_number` connects the will with the birth."""
        self.topics = topics
        self.primary_host = primary_host
        self.is_born = False
        self.device_is_born = False
        self.host_online = not primary_host
        self._host_utc_ms = 0
        self._birth_number = birth_number
        self._seq = 0

    def death(self, utc_ms: int) -> SparkplugMessage:
        """Return the death of the edge node. It is also the will, which the broker publishes."""
        self.is_born = self.device_is_born = False
        payload = encode_payload(encode_metrics([self._birth_metric(utc_ms)]), utc_ms)
        return SparkplugMessage(self.topics.node("NDEATH"), payload, qos=1)

    def birth(
        self, values: Mapping[str, Value] | None, vent_result: Value, utc_ms: int
    ) -> list[SparkplugMessage]:
        """Return the birth of the edge node, and of the device unless `values` is None."""
        self._seq, self.is_born, self.device_is_born = 0, True, False
        metrics = (
            self._birth_metric(utc_ms),
            MetricValue(REBIRTH, Datatype.BOOLEAN, False, utc_ms),
            MetricValue(VENT, Datatype.BOOLEAN, False, utc_ms),
            MetricValue(VENT_RESULT, Datatype.STRING, vent_result, utc_ms),
        )
        messages = [self._message(self.topics.node("NBIRTH"), encode_metrics(metrics), utc_ms)]
        return messages if values is None else [*messages, *self.device_birth(values, utc_ms)]

    def device_birth(self, values: Mapping[str, Value], utc_ms: int) -> list[SparkplugMessage]:
        """Return the birth of the device with all its values."""
        self.device_is_born = True
        vent = MetricValue(VENT, Datatype.BOOLEAN, False, utc_ms)
        metrics = encode_metrics([*metrics_of(values, utc_ms), vent], described=_BY_NAME)
        return [self._message(self.topics.of_device("DBIRTH"), metrics, utc_ms)]

    def device_death(self, utc_ms: int) -> list[SparkplugMessage]:
        """Return the death of the device if it is born: the host application marks its values as stale."""
        if not self.device_is_born:
            return []
        self.device_is_born = False
        return [self._message(self.topics.of_device("DDEATH"), b"", utc_ms)]

    def data(self, metrics: bytes, utc_ms: int) -> SparkplugMessage:
        """Return a message with encoded metrics of the device: current values, or historical ones."""
        return self._message(self.topics.of_device("DDATA"), metrics, utc_ms)

    def vent_result(self, result: str, utc_ms: int) -> SparkplugMessage:
        """Return the answer to a vent. The edge node sends it, because the device may be dead."""
        metric = MetricValue(VENT_RESULT, Datatype.STRING, result, utc_ms)
        return self._message(self.topics.node("NDATA"), encode_metrics([metric]), utc_ms)

    def on_host_state(self, payload: bytes) -> None:
        """Handle a state of the primary host application. An invalid or an older state is ignored."""
        try:
            state = json.loads(payload)
            online, utc_ms = state["online"], state["timestamp"]
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        if isinstance(online, bool) and isinstance(utc_ms, int) and utc_ms >= self._host_utc_ms:
            self._host_utc_ms, self.host_online = utc_ms, online

    def _birth_metric(self, utc_ms: int) -> MetricValue:
        return MetricValue(BIRTH_NUMBER, Datatype.INT64, self._birth_number, utc_ms)

    def _message(self, topic: str, metrics: bytes, utc_ms: int) -> SparkplugMessage:
        payload = encode_payload(metrics, utc_ms, self._seq)
        self._seq = (self._seq + 1) % SEQUENCE_NUMBERS
        return SparkplugMessage(topic, payload)


def metrics_of(values: Mapping[str, Value], utc_ms: int) -> list[MetricValue]:
    """Return values of the device with their datatypes."""
    return [MetricValue(name, _BY_NAME[name].datatype, value, utc_ms) for name, value in values.items()]
