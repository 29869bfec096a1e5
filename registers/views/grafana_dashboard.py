"""Dashboard for Grafana with the metrics of one instrument."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

Node = dict[str, Any]

_UID = "pneuforce"
_SOURCE: Node = {"type": "prometheus", "uid": "${datasource}"}
_WIDTH = 24


class Target(NamedTuple):
    """Query of a panel, with the name of its curves."""

    query: str
    legend: str = ""


class Panel(NamedTuple):
    """Panel of the dashboard. A row is full after 24 columns."""

    title: str
    kind: str
    width: int
    height: int
    unit: str
    targets: tuple[Target, ...]


def _metric(name: str, labels: str = "") -> str:
    return f'pneuforce_{name}{{instance="$instance"{labels}}}'


def _rate(name: str) -> str:
    return f"rate({_metric(name)}[$__rate_interval])"


def _increase(name: str) -> str:
    return f"increase({_metric(name)}[1h])"


_FORCE, _U = _metric("force_newtons"), _metric("force_standard_uncertainty_newtons")

PANELS = (
    Panel("Instrument", "stat", 4, 4, "up", (Target(_metric("instrument_up"), "instrument"),)),
    Panel("Rig", "stat", 4, 4, "up", (Target(_metric("rig_up"), "rig"),)),
    Panel("State", "stat", 4, 4, "name", (Target(f"{_metric('state')} == 1", "{{state}}"),)),
    Panel("Latched faults", "stat", 4, 4, "none", (Target(f"sum({_metric('fault_active')})", "faults"),)),
    Panel("Force", "stat", 4, 4, "forceN", (Target(_FORCE, "force"),)),
    Panel("Pressure", "stat", 4, 4, "pressurepa", (Target(_metric("pressure_pascals"), "pressure"),)),
    Panel(
        "Force with its expanded uncertainty (2 u)",
        "timeseries",
        12,
        8,
        "forceN",
        (
            Target(_FORCE, "force"),
            Target(f"{_FORCE} - 2 * {_U}", "lower"),
            Target(f"{_FORCE} + 2 * {_U}", "upper"),
            Target(_metric("force_limit_newtons"), "limit"),
        ),
    ),
    Panel(
        "Pressure",
        "timeseries",
        12,
        8,
        "pressurepa",
        (
            Target(_metric("pressure_pascals"), "pressure"),
            Target(_metric("setpoint_pascals"), "setpoint"),
            Target(_metric("baseline_pressure_pascals"), "baseline"),
        ),
    ),
    Panel("States", "state-timeline", 12, 8, "none", (Target(_metric("state"), "{{state}}"),)),
    Panel(
        "Faults that are latched",
        "table",
        12,
        8,
        "none",
        (Target(f"{_metric('fault_active')} == 1"),),
    ),
    Panel(
        "Time between two commands to the board",
        "heatmap",
        12,
        8,
        "s",
        (
            Target(
                f"sum by (le) (increase({_metric('command_gap_seconds_bucket')}[$__rate_interval]))", "{{le}}"
            ),
        ),
    ),
    Panel(
        "Samples per second",
        "timeseries",
        12,
        8,
        "cps",
        (Target(_rate("samples_total"), "measured"), Target(_rate("lost_samples_total"), "lost")),
    ),
    Panel(
        "Events per hour",
        "timeseries",
        12,
        8,
        "none",
        (
            Target(_increase("trips_total"), "trips"),
            Target(_increase("vents_total"), "vents"),
            Target(_increase("inflations_total"), "inflations"),
            Target(_increase("contacts_total"), "contacts"),
        ),
    ),
    Panel(
        "Rejected writes per hour",
        "timeseries",
        12,
        8,
        "none",
        (Target(f"{_increase('rejected_writes_total')} > 0", "{{reason}}"),),
    ),
    Panel(
        "Modbus",
        "timeseries",
        12,
        8,
        "cps",
        (
            Target(_rate("modbus_requests_total"), "requests {{transport}}"),
            Target(_rate("modbus_exceptions_total"), "exceptions {{transport}}"),
            Target(_metric("modbus_clients"), "clients {{transport}}"),
        ),
    ),
    Panel(
        "CAN",
        "timeseries",
        12,
        8,
        "cps",
        (
            Target(_rate("can_frames_total"), "frames {{direction}}"),
            Target(_rate("can_error_frames_total"), "error frames"),
            Target(_rate("can_unsent_frames_total"), "unsent frames"),
        ),
    ),
    Panel("Records of the event log", "timeseries", 8, 6, "none", (Target(_metric("event_log_records")),)),
    Panel("Head of the event log", "table", 8, 6, "none", (Target(_metric("event_log_info")),)),
    Panel("Versions", "table", 8, 6, "none", (Target(_metric("instrument_info")),)),
)

_ON_OFF = [
    {
        "type": "value",
        "options": {"0": {"text": "down", "color": "red"}, "1": {"text": "up", "color": "green"}},
    }
]


def render() -> str:
    """Return the dashboard as JSON."""
    dashboard = {
        "uid": _UID,
        "title": "pneuforce",
        "description": "Generated: pneuforce map --format grafana",
        "tags": ["pneuforce"],
        "schemaVersion": 39,
        "editable": True,
        "refresh": "10s",
        "time": {"from": "now-1h", "to": "now"},
        "templating": {"list": [_source_variable(), _instance_variable()]},
        "panels": list(_placed()),
    }
    return json.dumps(dashboard, indent=2, ensure_ascii=False) + "\n"


def _source_variable() -> Node:
    return {"name": "datasource", "label": "Prometheus", "type": "datasource", "query": "prometheus"}


def _instance_variable() -> Node:
    query = "label_values(pneuforce_instrument_up, instance)"
    return {
        "name": "instance",
        "label": "Instrument",
        "type": "query",
        "datasource": _SOURCE,
        "definition": query,
        "query": {"query": query, "refId": "instances"},
        "refresh": 2,
    }


def _placed() -> Iterator[Node]:
    """Yield the panels, from left to right and from top to bottom."""
    x = y = 0
    for number, panel in enumerate(PANELS, 1):
        yield _panel(panel, number) | {"gridPos": {"x": x, "y": y, "w": panel.width, "h": panel.height}}
        x += panel.width
        if x == _WIDTH:
            x, y = 0, y + panel.height


def _panel(panel: Panel, number: int) -> Node:
    is_table = panel.kind == "table"
    targets = [
        {
            "refId": chr(ord("A") + index),
            "datasource": _SOURCE,
            "expr": target.query,
            "legendFormat": target.legend or "__auto",
            "instant": is_table or panel.kind == "stat",
            "range": not is_table and panel.kind != "stat",
            "format": {"table": "table", "heatmap": "heatmap"}.get(panel.kind, "time_series"),
        }
        for index, target in enumerate(panel.targets)
    ]
    return {
        "id": number,
        "type": panel.kind,
        "title": panel.title,
        "datasource": _SOURCE,
        "targets": targets,
        "fieldConfig": {"defaults": _field_defaults(panel.unit), "overrides": []},
        "options": {"textMode": "name"} if panel.unit == "name" else {},
    }


def _field_defaults(unit: str) -> Node:
    if unit == "up":
        return {"unit": "none", "mappings": _ON_OFF}
    return {"unit": "none" if unit == "name" else unit}
