"""Alerts for Prometheus: condition, duration, severity, event and remedy.

The remedies of faults and status bits are those of `registers/advice.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from pneuforce.registers.advice import FAULT_ADVICE, MAINTENANCE_ADVICE, STATUS_ADVICE
from pneuforce.registers.codes import FAULTS

#: Name of the scrape job in prometheus.yml. Only the alert about a missing target needs this name.
JOB = "pneuforce"
CRITICAL, WARNING = "critical", "warning"


class Alert(NamedTuple):
    """Alert rule."""

    name: str
    condition: str  #: expression of Prometheus
    duration: str  #: time for which the condition must be true; empty: the alert fires at once
    severity: str
    summary: str
    remedy: str
    labels: Mapping[str, str] = MappingProxyType({})  #: labels that distinguish the rules with the same name


#: Status bits that have an alert, with the duration. Faults have an alert of their own.
_STATUS_BITS: Mapping[str, str] = {
    "can_down": "1m",
    "proof_test_overdue": "10m",
    "not_zeroed": "10m",
}

_COMPARE = (
    "If you did not begin a new log, keep the file. pneuforce log verify --witness finds the difference."
)

_PROCESSES = (
    Alert(
        "PneuforceTargetDown",
        f'up{{job="{JOB}"}} == 0',
        "1m",
        CRITICAL,
        "Prometheus cannot read the metrics.",
        "Check the network, and whether the instrument runs with [web] enabled = true. Its log states where "
        "the web page is served. web.allow must permit the address of Prometheus.",
    ),
    Alert(
        "PneuforceInstrumentDown",
        "pneuforce_instrument_up == 0",
        "30s",
        CRITICAL,
        "The web process receives no current values from the instrument.",
        "The host process is stopped or overloaded: read its log (journalctl -u pneuforce). Without a host "
        "process, the board vents the balloon.",
    ),
    Alert(
        "PneuforceRestarts",
        "changes(pneuforce_start_time_seconds[1h]) > 2",
        "",
        WARNING,
        "The instrument has started more than twice within one hour.",
        "Read the reason for each end in the event log (pneuforce log show) and in the log of the process.",
    ),
    Alert(
        "PneuforceTripsOften",
        "increase(pneuforce_trips_total[1h]) > 3",
        "",
        WARNING,
        "The rig has tripped more than three times within one hour.",
        "Find the cause of the faults in the event log (pneuforce log show) before you inflate again.",
    ),
    Alert(
        "PneuforceCommandGap",
        "increase(pneuforce_command_gap_seconds_count[10m]) - ignoring (le) "
        'increase(pneuforce_command_gap_seconds_bucket{le="0.25"}[10m]) > 0.5',
        "",
        WARNING,
        "The board received no command for more than 0.25 s, and closed the inlet valve.",
        "Reduce the load of the computer, or give the instrument a higher priority (docs/service.md).",
    ),
    Alert(
        "PneuforceSamplesLost",
        "rate(pneuforce_lost_samples_total[5m]) > 0.001 * rate(pneuforce_samples_total[5m])",
        "5m",
        WARNING,
        "More than 0.1 % of the samples do not arrive.",
        "Check the USB cable of the board, its connectors, and the load of the computer.",
    ),
    Alert(
        "PneuforceCalibrationOld",
        "time() - pneuforce_calibration_time_seconds > 365 * 86400",
        "",
        WARNING,
        "The calibration is older than one year.",
        "Calibrate the instrument again (docs/calibration.md).",
    ),
    Alert(
        "PneuforceUncertaintyLarge",
        "2 * pneuforce_force_standard_uncertainty_newtons > 0.75 * pneuforce_force_newtons and "
        "pneuforce_force_newtons > pneuforce_force_lower_range_limit_newtons",
        "30s",
        WARNING,
        "The expanded uncertainty of the force is larger than 75 % of the force.",
        "End the contact, vent and hold again: the baseline is then new. pneuforce uncertainty shows the "
        "largest contribution; a calibration of the force reduces it (docs/calibration.md).",
    ),
)

_CLIENTS = (
    Alert(
        "PneuforceWritesRejected",
        "sum without (reason) (rate(pneuforce_rejected_writes_total[5m])) > 0.1",
        "5m",
        WARNING,
        "The instrument rejects more than 6 writes per minute.",
        "The event log (pneuforce log show) names the client, the value and the reason. docs/faults.md "
        "contains the remedy for each reject reason.",
    ),
    Alert(
        "PneuforceFailedLogins",
        "sum without (reason) (increase(pneuforce_failed_logins_total[10m])) > 5",
        "",
        WARNING,
        "More than 5 logins on the web page have failed within 10 minutes.",
        "If no operator did this, find out who uses the address in the event log (pneuforce log show), and "
        "restrict web.allow.",
    ),
    Alert(
        "PneuforceModbusEvictions",
        "increase(pneuforce_modbus_evictions_total[10m]) > 0",
        "",
        WARNING,
        "Modbus connections were closed, because too many clients are connected.",
        "Find clients that open connections without closing them, or raise modbus.max_connections.",
    ),
    Alert(
        "PneuforceMqttNotConnected",
        "pneuforce_mqtt_connected == 0",
        "5m",
        WARNING,
        "The MQTT broker is not connected: values wait in the store.",
        "Check broker, network and certificate. The log names the reason (journalctl -u pneuforce).",
    ),
    Alert(
        "PneuforceMqttRecordsLost",
        "increase(pneuforce_mqtt_lost_records_total[10m]) > 0",
        "",
        WARNING,
        "Values were lost, because the MQTT broker did not receive them in time.",
        "Connect the broker. Check the disk, and raise mqtt.store_max_mb or mqtt.store_max_age_h.",
    ),
    Alert(
        "PneuforceCanErrors",
        "rate(pneuforce_can_error_frames_total[5m]) > 1",
        "5m",
        WARNING,
        "The CAN controller reports errors.",
        "Check the bit rate, the terminating resistors, the cable and the other nodes of the CAN bus.",
    ),
    Alert(
        "PneuforceMapChanged",
        "count by (job, instance) (count by (job, instance, map_hash) "
        "(present_over_time(pneuforce_instrument_info[1h]))) > 1",
        "",
        WARNING,
        "The register map has changed.",
        "Compare the programs of PLCs and robots with the new map. They find the hash in register 770.",
    ),
)

#: Parts of the instrument whose certificate has a metric with the time until its end, with their names.
_CERTIFICATES: Mapping[str, str] = {
    "web": "the web page",
    "modbus_tls": "Modbus/TCP Security",
    "mqtt": "the MQTT client",
}


def _certificate_alerts(server: str, name: str) -> tuple[Alert, ...]:
    """Return the alerts about the end of a certificate: 30 days before, and when it has expired."""
    left, alert = (
        f"pneuforce_{server}_certificate_left_seconds",
        "".join(word.capitalize() for word in server.split("_")),
    )
    remedy = "Replace certificate and key. The instrument reads the new files without a restart."
    return (
        Alert(
            f"Pneuforce{alert}CertificateExpires",
            f"{left} < 30 * 86400",
            "1m",
            WARNING,
            f"The certificate of {name} expires in less than 30 days, or has expired.",
            remedy,
        ),
        Alert(
            f"Pneuforce{alert}CertificateExpired",
            f"{left} < 0",
            "1m",
            CRITICAL,
            f"The certificate of {name} has expired: it is rejected.",
            f"{remedy} Also check the clock of the computer.",
        ),
    )


_FILES = (
    Alert(
        "PneuforceRecordingFailed",
        "pneuforce_recording_failed == 1",
        "",
        WARNING,
        "A recording has stopped by itself.",
        "The log of the process names the reason, for example a full disk. Start the recording again.",
    ),
    Alert(
        "PneuforceEventLogFailed",
        "pneuforce_event_log_failed == 1",
        "1m",
        WARNING,
        "The event log cannot be written. Up to 10,000 records wait in memory.",
        "Check whether the disk is full, read-only or missing. The log of the process names the reason.",
    ),
    Alert(
        "PneuforceEventLogShorter",
        "pneuforce_event_log_records < max_over_time(pneuforce_event_log_records[1d])",
        "",
        CRITICAL,
        "The event log has fewer records than before: it was cut, replaced or moved away.",
        _COMPARE,
    ),
    Alert(
        "PneuforceEventLogRewritten",
        "count by (job, instance, records) (present_over_time(pneuforce_event_log_info[1d])) > 1",
        "",
        CRITICAL,
        "The event log had two different heads with the same number of records: it was rewritten, or a new "
        "log was begun.",
        _COMPARE,
    ),
)


def _fault(code: int, name: str) -> Alert:
    what, do = FAULT_ADVICE[code]
    condition = f'pneuforce_fault_active{{code="{code}"}} == 1'
    return Alert(
        "PneuforceFault", condition, "", CRITICAL, f"Fault {code} ({name}): {what}", do, {"code": str(code)}
    )


def _status(bit: str, duration: str) -> Alert:
    what, do = STATUS_ADVICE[bit]
    name = "".join(word.capitalize() for word in bit.split("_"))
    return Alert(f"Pneuforce{name}", f'pneuforce_status{{bit="{bit}"}} == 1', duration, WARNING, what, do)


def _maintenance(cause: str) -> Alert:
    what, do = MAINTENANCE_ADVICE[cause]
    condition = f'pneuforce_maintenance_cause{{cause="{cause}"}} == 1'
    summary = f"Maintenance required: {what}"
    return Alert("PneuforceMaintenanceRequired", condition, "1m", WARNING, summary, do, {"cause": cause})


#: Alerts by the name of their group.
ALERTS: Mapping[str, tuple[Alert, ...]] = {
    "pneuforce-faults": tuple(_fault(code, name) for code, name in FAULTS.names.items() if code),
    "pneuforce-status": tuple(_status(bit, duration) for bit, duration in _STATUS_BITS.items()),
    "pneuforce-maintenance": tuple(map(_maintenance, MAINTENANCE_ADVICE)),
    "pneuforce-processes": _PROCESSES,
    "pneuforce-clients": _CLIENTS,
    "pneuforce-files": _FILES,
    "pneuforce-certificates": tuple(
        alert for server, name in _CERTIFICATES.items() for alert in _certificate_alerts(server, name)
    ),
}
