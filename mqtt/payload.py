"""Payloads of Sparkplug B as bytes: metrics with their values, and commands of host applications."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from google.protobuf.message import DecodeError

from pneuforce.errors import PneuforceError
from pneuforce.mqtt.schema import PayloadMessage
from pneuforce.registers.sparkplug import Datatype, SparkplugMetric, Value

MAX_COMMAND_BYTES = 65_536

_FIELDS: Mapping[Datatype, str] = {
    Datatype.INT64: "long_value",
    Datatype.FLOAT: "float_value",
    Datatype.BOOLEAN: "boolean_value",
    Datatype.STRING: "string_value",
}
_DOUBLE = 10  #: datatype of the properties engLow and engHigh


class InvalidPayload(PneuforceError, ValueError):
    """Received bytes that are no payload of Sparkplug B."""


class MetricValue(NamedTuple):
    """Value of a metric at a time. None is transmitted as null."""

    name: str
    datatype: Datatype
    value: Value
    utc_ms: int  #: time of the value since 1970-01-01 [ms]


class CommandMetric(NamedTuple):
    """Metric of a received command. `value` is None if the value is null or has an unsupported type."""

    name: str
    value: Value


def encode_metrics(
    metrics: Iterable[MetricValue],
    *,
    historical: bool = False,
    described: Mapping[str, SparkplugMetric] | None = None,
) -> bytes:
    """Return the metrics of a payload. Metrics that are encoded separately can be joined.

    A birth message gives `described`: metrics whose unit, range and meaning are added as properties.
    """
    payload = PayloadMessage()
    for metric in metrics:
        message = payload.metrics.add(name=metric.name, timestamp=metric.utc_ms, datatype=metric.datatype)
        if historical:
            message.is_historical = True
        if metric.value is None:
            message.is_null = True
        else:
            setattr(message, _FIELDS[metric.datatype], metric.value)
        if described and metric.name in described:
            _add_properties(message.properties, described[metric.name])
    return bytes(payload.SerializeToString())


def _add_properties(properties: Any, metric: SparkplugMetric) -> None:
    """Add the properties that host applications show, by the names that are in common use."""
    for key, value in (
        ("engUnit", metric.unit),
        ("engLow", metric.low),
        ("engHigh", metric.high),
        ("documentation", metric.doc),
    ):
        if isinstance(value, str) and value:
            properties.keys.append(key)
            properties.values.add(type=Datatype.STRING, string_value=value)
        elif isinstance(value, int | float):
            properties.keys.append(key)
            properties.values.add(type=_DOUBLE, double_value=value)


def encode_payload(metrics: bytes, utc_ms: int, seq: int | None = None) -> bytes:
    """Return a payload of encoded metrics. `seq` is the sequence number; the will has none.

    Protobuf joins messages by joining their bytes, so stored metrics are not decoded again.
    """
    head = PayloadMessage(timestamp=utc_ms)
    if seq is not None:
        head.seq = seq
    return metrics + bytes(head.SerializeToString())


def decode_command(data: bytes) -> list[CommandMetric]:
    """Return the metrics of a command. Raises InvalidPayload."""
    if len(data) > MAX_COMMAND_BYTES:
        raise InvalidPayload(f"{len(data)} bytes are too long for a command")
    payload = PayloadMessage()
    try:
        payload.ParseFromString(data)
        is_text = all(isinstance(metric.name, str) for metric in payload.metrics)  # bytes if it is not UTF-8
    except (DecodeError, ValueError):
        is_text = False
    if not is_text:
        raise InvalidPayload(f"{len(data)} bytes are no payload of Sparkplug B")
    return [CommandMetric(metric.name, _value_of(metric)) for metric in payload.metrics]


def _value_of(metric: Any) -> Value:
    """Return the value of a received metric, None if value and datatype do not belong together."""
    field = metric.WhichOneof("value")
    datatype = metric.datatype
    wrong_type = datatype and _FIELDS.get(datatype) != field
    if field is None or wrong_type or metric.is_null:
        return None
    value: Value = getattr(metric, field)
    return value
