"""Text of the metrics for Prometheus, from the latest entries of the instrument.

`registers/metrics.py` contains the table of the metrics. The host process counts, so that a restart of the
web process resets no counter.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from functools import reduce
from itertools import accumulate
from typing import Any, NamedTuple

from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
)
from prometheus_client.core import Metric as MetricFamily
from prometheus_client.exposition import choose_encoder
from prometheus_client.registry import Collector, CollectorRegistry

from pneuforce.registers.metric import PREFIX, Choice, Metric, MetricType, Series
from pneuforce.registers.metrics import METRICS
from pneuforce.web.browser_feed import BrowserFeed

Reading = Mapping[str, Any]
#: Label values of a sample, with its value.
Values = Iterator[tuple[tuple[str, ...], float]]


class MetricsText(NamedTuple):
    """Metrics as text, and the media type of the text."""

    text: bytes
    media_type: str


def metrics_text(reading: Reading, accept: str) -> MetricsText:
    """Return the metrics in the format that the header `Accept` requests: OpenMetrics or Prometheus text."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_ReadingCollector(reading))
    encode, media_type = choose_encoder(accept)
    return MetricsText(encode(registry), media_type)


def reading_of(feed: BrowserFeed) -> Reading:
    """Return the values for the metrics. If the values are not current, the reading contains only that."""
    if feed.snapshot is None or not feed.health:
        return {"derived": {"up": 0}}
    health, events = feed.health, feed.health.get("events") or {}
    records = events.get("records")
    derived = {
        "up": 1,
        "calibration_utc_s": _date_utc_s(feed.snapshot.get("calibration_date")),
        "modbus_tcp_clients": _length(health, "modbus_tcp", "clients"),
        "modbus_tls_clients": _length(health, "modbus_tls", "clients"),
        "event_log_records": records or None,
        "event_log_head": events.get("head") if records else None,
    }
    return {"header": feed.header, "snapshot": feed.snapshot, "health": health, "derived": derived}


def _date_utc_s(date: object) -> float | None:
    """Return the Unix time [s] of a date YYYYMMDD, None if there is no date."""
    try:
        return datetime.strptime(str(date), "%Y%m%d").replace(tzinfo=UTC).timestamp()
    except ValueError:
        return None


def _length(health: Mapping[str, Any], section: str, name: str) -> int | None:
    found = (health.get(section) or {}).get(name)
    return None if found is None else len(found)


class _ReadingCollector(Collector):
    """Collector of the metrics of one reading."""

    def __init__(self, reading: Reading) -> None:
        self._reading = reading

    def collect(self) -> Iterable[MetricFamily]:
        """Return each metric of the table, also a metric without a sample."""
        return [_family(metric, self._reading) for metric in METRICS]


def _family(metric: Metric, reading: Reading) -> MetricFamily:
    name = f"{PREFIX}{metric.name}"
    if metric.type is MetricType.INFO:
        return _info(name, metric, reading)
    if metric.type is MetricType.HISTOGRAM:
        return _histogram(name, metric, reading)
    family_type = CounterMetricFamily if metric.type is MetricType.COUNTER else GaugeMetricFamily
    family = family_type(name, metric.doc, labels=metric.labels)
    for labels, value in _values(metric, reading):
        family.add_metric(labels, value * metric.factor)
    return family


def _info(name: str, metric: Metric, reading: Reading) -> InfoMetricFamily:
    """Return an info metric. It has no sample if no label has a value."""
    assert isinstance(metric.source, Mapping)
    found = {label: _at(reading, path) for label, path in metric.source.items()}
    family = InfoMetricFamily(name, metric.doc)
    if any(value is not None for value in found.values()):
        family.add_metric((), {label: "" if v is None else str(v) for label, v in found.items()})
    return family


def _histogram(name: str, metric: Metric, reading: Reading) -> HistogramMetricFamily:
    family = HistogramMetricFamily(name, metric.doc)
    found = _at(reading, metric.source)
    if found:
        bounds = [*map(str, found["bounds_s"]), "+Inf"]
        buckets = list(zip(bounds, accumulate(found["counts"]), strict=True))
        family.add_metric((), buckets, found["sum_s"])
    return family


def _values(metric: Metric, reading: Reading) -> Values:
    """Yield the samples of a gauge or a counter. A value that is not available has no sample."""
    found: Mapping[tuple[str, ...], Any]
    if isinstance(metric.source, Mapping):
        found = {(label,): _at(reading, path) for label, path in metric.source.items()}
    elif metric.series is not None:
        found = _series(metric.series, _at(reading, metric.source))
    else:
        found = {(): _at(reading, metric.source)}
    for labels, value in found.items():
        if value is not None and math.isfinite(number := _number(value)):
            yield labels, number


def _series(series: Series, found: Any) -> Mapping[tuple[str, ...], Any]:
    """Return the values of all series, and of each key of a count that the table does not contain."""
    if found is None:
        return {}
    if series.choice is Choice.COUNT:
        keys: Iterable[Any] = dict.fromkeys([*series.labels, *found])
        return {series.labels.get(key, _unknown(key, series)): found.get(key, 0) for key in keys}
    members = found if isinstance(found, list) else [found]
    return {labels: key in members for key, labels in series.labels.items()}


def _unknown(key: str, series: Series) -> tuple[str, ...]:
    """Return the labels of a key that the table does not contain."""
    size = len(next(iter(series.labels.values())))
    return (key, *("unknown",) * (size - 1))


def _number(value: Any) -> float:
    """Return a value as a number. A text is 1 unless it is empty."""
    return float(bool(value)) if isinstance(value, str) else float(value)


def _at(reading: Reading, path: str | Mapping[str, str]) -> Any:
    """Return the value at a path, None if a part of the path is missing."""
    assert isinstance(path, str)

    def step(value: Any, name: str) -> Any:
        return value.get(name) if isinstance(value, Mapping) else None

    return reduce(step, path.split("."), reading)
