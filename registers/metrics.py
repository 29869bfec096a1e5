"""Metrics for Prometheus: name, type, meaning, labels and source of each metric.

The source is a path in a reading. A reading contains the header, the latest SNAPSHOT and the latest HEALTH of
the stream, and `derived`, the values that the web process computes (`web/metrics.py`).
"""

from __future__ import annotations

from collections.abc import Mapping

from pneuforce.registers.codes import FAULTS, MAINTENANCE_CAUSES, REJECT_REASONS, STATES, STATUS
from pneuforce.registers.metric import Choice, Metric, MetricType, Series

_PA_PER_KPA = 1e3
_FAULT_CODES = {code: (str(code), name) for code, name in FAULTS.names.items() if code}


def _names(names: Mapping[int, str]) -> dict[str, tuple[str, ...]]:
    return {name: (name,) for name in names.values()}


def _gauge(name: str, doc: str, source: str, factor: float = 1.0) -> Metric:
    return Metric(name, MetricType.GAUGE, doc, source, factor=factor)


def _counter(name: str, doc: str, source: str) -> Metric:
    return Metric(name, MetricType.COUNTER, doc, source)


def _count(name: str, doc: str, source: str, label: str, keys: Mapping[str, tuple[str, ...]]) -> Metric:
    return Metric(name, MetricType.COUNTER, doc, source, (label,), Series(Choice.COUNT, keys))


def _member(name: str, doc: str, source: str, label: str, names: Mapping[int, str]) -> Metric:
    return Metric(name, MetricType.GAUGE, doc, source, (label,), Series(Choice.MEMBER, _names(names)))


def _modbus(name: str, doc: str, counter: str, *transports: str) -> Metric:
    sources = {transport: f"health.modbus_{transport}.{counter}" for transport in transports}
    return Metric(f"modbus_{name}", MetricType.COUNTER, doc, sources, ("transport",))


_LINES, _NETWORKS = ("tcp", "tls", "rtu"), ("tcp", "tls")

_INSTRUMENT = (
    _gauge(
        "instrument_up",
        "1 while the web process receives current values from the instrument. Otherwise 0, and no other "
        "metric has a sample.",
        "derived.up",
    ),
    Metric(
        "instrument",
        MetricType.INFO,
        "Versions and identity of the instrument; the value is 1.",
        {
            "version": "header.version",
            "map_version": "header.map_version",
            "map_hash": "header.map_hash",
            "configuration_hash": "header.configuration_hash",
            "configuration_signature": "snapshot.configuration_signature",
            "calibration_signature": "snapshot.calibration_signature",
            "serial_number": "header.serial_number",
            "board": "health.rig.board",
            "firmware": "health.rig.firmware",
            "method": "snapshot.method",
        },
    ),
    _gauge("start_time_seconds", "Start of the host process, as Unix time.", "health.started_utc_s"),
    _member("state", "1 for the present state, 0 for all others.", "snapshot.state", "state", STATES.names),
    _member(
        "status",
        "1 for each status bit that is set, 0 for all others.",
        "snapshot.status",
        "bit",
        {bit.number: bit.name for bit in STATUS.bits},
    ),
    _member(
        "maintenance_cause",
        "1 for each cause of the status bit maintenance_required that is present, 0 for all others.",
        "snapshot.maintenance_causes",
        "cause",
        {bit.number: bit.name for bit in MAINTENANCE_CAUSES.bits},
    ),
    _gauge(
        "calibration_time_seconds",
        "Date of the calibration, as Unix time of its beginning in UTC.",
        "derived.calibration_utc_s",
    ),
)

_MEASUREMENT = (
    _gauge("force_newtons", "Force. No sample if no force is valid.", "snapshot.force_n"),
    _gauge(
        "force_standard_uncertainty_newtons",
        "Standard uncertainty of the force. The expanded uncertainty is twice this value.",
        "snapshot.force_std_n",
    ),
    _gauge(
        "force_lower_range_limit_newtons",
        "Lower range limit: a smaller force is touch only.",
        "snapshot.force_lower_range_limit_n",
    ),
    _gauge("force_limit_newtons", "Limit of the first force alarm.", "snapshot.force_limit_n"),
    _gauge("pressure_pascals", "Gauge pressure of the balloon.", "snapshot.pressure_kpa", _PA_PER_KPA),
    _gauge(
        "baseline_pressure_pascals",
        "Gauge pressure of the balloon without contact.",
        "snapshot.baseline_pressure_kpa",
        _PA_PER_KPA,
    ),
    _gauge("setpoint_pascals", "Setpoint in effect.", "snapshot.setpoint_kpa", _PA_PER_KPA),
    _counter("contacts", "Contacts that have started.", "snapshot.contact_counter"),
    _gauge("proof_test_age_seconds", "Time since the last proof test.", "snapshot.proof_test_age_s"),
    _gauge("baseline_age_seconds", "Age of the baseline pressure.", "snapshot.baseline_age_s"),
    _gauge(
        "ambient_pascals",
        "Absolute ambient pressure in effect: the last written one, or the configured one.",
        "snapshot.ambient_in_effect_kpa",
        _PA_PER_KPA,
    ),
    _gauge(
        "ambient_age_seconds",
        "Time since the ambient pressure was written. No sample if it was never written.",
        "snapshot.ambient_age_s",
    ),
)

_RIG = (
    _gauge("rig_up", "1 while samples arrive from the rig.", "health.rig.up"),
    _gauge("sample_age_seconds", "Age of the latest sample.", "snapshot.age_s"),
    _counter("samples", "Samples that were measured.", "health.rig.samples"),
    _counter("lost_samples", "Samples that did not arrive.", "health.rig.lost_frames"),
    _counter("repeated_samples", "Samples that arrived again.", "health.rig.repeated_frames"),
    _counter(
        "implausible_samples",
        "Samples with a value or a time that no board can send.",
        "health.rig.implausible_frames",
    ),
    _counter("rig_damaged_bytes", "Bytes from the rig that belong to no frame.", "health.rig.damaged_bytes"),
    _counter("rig_reconnects", "Times that the port of the rig was opened again.", "health.rig.reconnects"),
    _counter("board_restarts", "Restarts of the board.", "health.rig.board_restarts"),
    _gauge("board_clock_error_ratio", "Rate error of the board's clock.", "health.rig.clock_error"),
    Metric(
        "command_gap_seconds",
        MetricType.HISTOGRAM,
        "Time between two commands to the board. After 0.25 s, the board closes the inlet.",
        "health.rig.command_gaps",
    ),
)

_PROTECTION = (
    Metric(
        "fault_active",
        MetricType.GAUGE,
        "1 for each latched fault, 0 for all others.",
        "snapshot.faults",
        ("code", "fault"),
        Series(Choice.MEMBER, _FAULT_CODES),
    ),
    Metric(
        "faults",
        MetricType.COUNTER,
        "Faults that have occurred. A latched fault is not counted again.",
        "health.counts.faults",
        ("code", "fault"),
        Series(Choice.COUNT, {str(code): labels for code, labels in _FAULT_CODES.items()}),
    ),
    _counter("trips", "Changes to the state tripped.", "health.counts.trips"),
    _counter("vents", "Vents of an inflated balloon without a trip.", "health.counts.vents"),
    _counter(
        "inflations",
        "Inflations of this balloon. The command new_balloon starts at 0 again.",
        "snapshot.inflation_count",
    ),
    _count(
        "rejected_writes",
        "Write requests that were rejected, by reason: a reject reason, or the error of the bus.",
        "health.counts.rejected_writes",
        "reason",
        _names({code: name for code, name in REJECT_REASONS.names.items() if code}),
    ),
    _count(
        "failed_logins",
        "Failed logins on the web page, and requests that the login does not permit.",
        "health.counts.failed_logins",
        "reason",
        _names(dict(enumerate(("wrong_password", "too_many_attempts", "not_logged_in", "not_permitted")))),
    ),
)

_BUSES = (
    _modbus("requests", "Modbus requests.", "requests", *_LINES),
    _modbus("exceptions", "Requests that were answered with an exception code.", "exceptions", *_LINES),
    Metric(
        "modbus_clients",
        MetricType.GAUGE,
        "Connected clients of Modbus TCP and of Modbus/TCP Security (tls).",
        {transport: f"derived.modbus_{transport}_clients" for transport in _NETWORKS},
        ("transport",),
    ),
    _modbus("connections", "Accepted connections.", "connections", *_NETWORKS),
    _modbus("evictions", "Connections closed because of too many clients.", "evicted", *_NETWORKS),
    _modbus("timeouts", "Connections closed because of an idle or slow client.", "timeouts", *_NETWORKS),
    _modbus("invalid_frames", "Connections closed by an invalid frame.", "invalid_frames", *_NETWORKS),
    _modbus("not_allowed", "Connections closed because of their address.", "not_allowed", *_NETWORKS),
    _counter(
        "modbus_tls_failed_handshakes",
        "Failed handshakes of Modbus/TCP Security, for example with an unknown certificate.",
        "health.modbus_tls.failed",
    ),
    *(
        _gauge(
            f"{server}_certificate_left_seconds",
            f"Time until the certificate of {name} expires.",
            f"health.{server}.certificate_days",
            86_400.0,
        )
        for server, name in (
            ("modbus_tls", "Modbus/TCP Security"),
            ("web", "the web page"),
            ("mqtt", "the MQTT client"),
        )
    ),
    _gauge("modbus_rtu_up", "1 while the serial line of Modbus RTU works.", "health.modbus_rtu.up"),
    _gauge("can_up", "1 while CAN frames can be sent and received.", "health.can.up"),
    Metric(
        "can_frames",
        MetricType.COUNTER,
        "CAN frames that were sent and received.",
        {"sent": "health.can.sent", "received": "health.can.received"},
        ("direction",),
    ),
    _counter(
        "can_unsent_frames",
        "CAN frames that were not sent: bus down, queue or controller full, or frame too old.",
        "health.can.dropped",
    ),
    _counter("can_error_frames", "Error reports of the local CAN controller.", "health.can.error_frames"),
    _counter("can_reopened", "Times that the CAN interface was opened again.", "health.can.reopened"),
    _gauge("rdt_clients", "Clients that receive records over RDT.", "health.rdt.clients"),
    _counter("rdt_records", "RDT records that were sent.", "health.rdt.records"),
    _counter(
        "rdt_unsent_records",
        "RDT records that the operating system did not accept.",
        "health.rdt.dropped",
    ),
    _counter("rdt_requests", "RDT requests.", "health.rdt.requests"),
    _counter("rdt_refused_requests", "RDT requests without an effect.", "health.rdt.refused"),
    _gauge("mqtt_connected", "1 while the MQTT broker is connected.", "health.mqtt.connected"),
    _gauge("mqtt_stored_records", "Records that wait for the MQTT broker.", "health.mqtt.stored"),
    _counter(
        "mqtt_lost_records",
        "Records that the MQTT broker never received: too old, or the store was full or not usable.",
        "health.mqtt.lost",
    ),
)

_FILES = (
    _gauge("recording", "1 while a recorder is connected.", "health.recording.on"),
    _gauge("recording_failed", "1 if the last recording stopped by itself.", "health.recording.trouble"),
    _gauge("event_log_failed", "1 while the event log cannot be written.", "health.events.trouble"),
    _gauge("event_log_records", "Records of the event log on the disk.", "health.events.records"),
    Metric(
        "event_log",
        MetricType.INFO,
        "Number of records of the event log on the disk, and digest of the last record; the value is 1. Each "
        "record starts a new series and ends the previous one.",
        {"records": "derived.event_log_records", "head": "derived.event_log_head"},
    ),
)

#: Metrics by the heading of the document.
GROUPS: Mapping[str, tuple[Metric, ...]] = {
    "Instrument": _INSTRUMENT,
    "Measurement": _MEASUREMENT,
    "Link to the rig": _RIG,
    "Protection": _PROTECTION,
    "Buses": _BUSES,
    "Recording and event log": _FILES,
}
METRICS = tuple(metric for group in GROUPS.values() for metric in group)
