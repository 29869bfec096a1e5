"""Declaration of a metric for Prometheus: its type, labels, series and source."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum, auto
from typing import Any, NamedTuple

PREFIX = "pneuforce_"


class MetricType(StrEnum):
    """Type of a metric, as Prometheus names it."""

    GAUGE = auto()
    COUNTER = auto()
    HISTOGRAM = auto()
    INFO = auto()


class Choice(StrEnum):
    """Form of a source with one value for each series."""

    COUNT = auto()  #: an object of numbers by key; a missing key is 0
    MEMBER = auto()  #: one key, or a list of keys; the series of these keys are 1, all others are 0


class Series(NamedTuple):
    """Series of a metric that are always present: the label values of each key of the source."""

    choice: Choice
    labels: Mapping[Any, tuple[str, ...]]


class Metric(NamedTuple):
    """Metric with the prefix `pneuforce_`. A value that is not available has no sample."""

    name: str  #: without prefix, and without the suffix of its type
    type: MetricType
    doc: str
    #: Path in the reading. Several paths: one for each value of the label. For an info metric, one for each
    #: label. A text counts as 1 unless it is empty.
    source: str | Mapping[str, str]
    labels: tuple[str, ...] = ()
    series: Series | None = None
    factor: float = 1.0  #: from the unit of the source to the unit of the metric

    @property
    def full_name(self) -> str:
        """Return the name of the samples, which a query uses. A histogram has `_bucket`, `_sum`, `_count`."""
        return f"{PREFIX}{self.name}{_SUFFIXES.get(self.type, '')}"


_SUFFIXES = {MetricType.COUNTER: "_total", MetricType.INFO: "_info"}
