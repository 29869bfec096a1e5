"""Alert rules for Prometheus as a YAML file."""

from __future__ import annotations

import json
from collections.abc import Iterator

from pneuforce.registers.views.alert_table import ALERTS, Alert

_HEAD = """\
# Alert rules of pneuforce for Prometheus: docs/how-to/prometheus.md.
# Generated: pneuforce map --format prometheus-rules > pneuforce.rules.yml
groups:
"""


def render() -> str:
    """Return the file."""
    return _HEAD + "".join(f"{line}\n" for line in _lines())


def _lines() -> Iterator[str]:
    for group, alerts in ALERTS.items():
        yield f"  - name: {group}"
        yield "    rules:"
        for alert in alerts:
            yield from _rule(alert)


def _rule(alert: Alert) -> Iterator[str]:
    yield f"      - alert: {alert.name}"
    yield f"        expr: '{alert.condition}'"
    if alert.duration:
        yield f"        for: {alert.duration}"
    labels = "".join(f', {name}: "{value}"' for name, value in alert.labels.items())
    yield f"        labels: {{severity: {alert.severity}{labels}}}"
    yield "        annotations:"
    yield f"          summary: {_quoted('{{ $labels.instance }}: ' + alert.summary)}"
    yield f"          remedy: {_quoted(alert.remedy)}"


def _quoted(text: str) -> str:
    """Return a string of YAML. Each string of JSON is also a string of YAML."""
    return json.dumps(text, ensure_ascii=False)
