"""Tests of the alert rules with promtool, and of the dashboard and the page of the metrics."""

import json
import re
import subprocess

import pytest

from pneuforce.registers.codes import MAINTENANCE_CAUSES
from pneuforce.registers.metric import MetricType
from pneuforce.registers.metrics import METRICS
from pneuforce.registers.views import VIEWS, grafana_dashboard, metrics_page, prometheus_rules
from pneuforce.registers.views.alert_table import ALERTS, JOB
from tests.prometheus_tools import NEEDS_PROMETHEUS, PROMTOOL

TARGET = {"instance": "rig-1:8080", "job": JOB}
RULES = [alert for group in ALERTS.values() for alert in group]
BY_KEY = {" ".join((rule.name.removeprefix("Pneuforce"), *rule.labels.values())): rule for rule in RULES}
INTERVAL = "15s"
#: Values of 20 minutes: constant, with one step up or down after 10 minutes, or with a constant rate.
ZERO, ONE, STEP_UP, STEP_DOWN = "0x80", "1x80", "0x40 7x40", "900x40 899x40"
HEAD = 'pneuforce_event_log_info{records="900",head="%s"}'
INFO = 'pneuforce_instrument_info{map_hash="%s"}'

#: Series that fire each alert within 20 minutes, labels of the alert, and values of these series that do not
#: fire the alert.
CASES = {
    "CanDown": ({'pneuforce_status{bit="can_down"}': ONE}, {"bit": "can_down"}, ZERO),
    "ProofTestOverdue": (
        {'pneuforce_status{bit="proof_test_overdue"}': ONE},
        {"bit": "proof_test_overdue"},
        ZERO,
    ),
    "NotZeroed": ({'pneuforce_status{bit="not_zeroed"}': ONE}, {"bit": "not_zeroed"}, ZERO),
    "TargetDown": ({"up": ZERO}, {}, ONE),
    "InstrumentDown": ({"pneuforce_instrument_up": ZERO}, {}, ONE),
    "Restarts": ({"pneuforce_start_time_seconds": "5x10 6x10 7x10 8x47"}, {}, "5x10 6x69"),
    "TripsOften": ({"pneuforce_trips_total": STEP_UP}, {}, "0x10 1x20 2x48"),
    "CommandGap": (
        {
            "pneuforce_command_gap_seconds_count": "0+300x40 12001+300x40",
            'pneuforce_command_gap_seconds_bucket{le="0.25"}': "0+300x40 12000+300x40",
        },
        {},
        "0+300x80",
    ),
    "SamplesLost": (
        {"pneuforce_samples_total": "0+7500x80", "pneuforce_lost_samples_total": "0+8x80"},
        {},
        "0x80",
    ),
    "CalibrationOld": ({"pneuforce_calibration_time_seconds": "-31536000x80"}, {}, "-31530000x80"),
    "WritesRejected": (
        {
            'pneuforce_rejected_writes_total{reason="state"}': "0+1x80",
            'pneuforce_rejected_writes_total{reason="lease"}': "0+1x80",
        },
        {},
        "0+0.7x80",
    ),
    "FailedLogins": (
        {'pneuforce_failed_logins_total{reason="wrong_password"}': "0x60 6x20"},
        {},
        "0x60 4x20",
    ),
    "ModbusEvictions": (
        {'pneuforce_modbus_evictions_total{transport="tcp"}': "0x60 1x20"},
        {"transport": "tcp"},
        "5x80",
    ),
    "UncertaintyLarge": (
        {
            "pneuforce_force_standard_uncertainty_newtons": "0.4x80",
            "pneuforce_force_newtons": ONE,
            "pneuforce_force_lower_range_limit_newtons": "0.5x80",
        },
        {},
        "0.3x80",
    ),
    "MqttNotConnected": ({"pneuforce_mqtt_connected": ZERO}, {}, ONE),
    "MqttRecordsLost": ({"pneuforce_mqtt_lost_records_total": "0x60 1x20"}, {}, "5x80"),
    "CanErrors": ({"pneuforce_can_error_frames_total": "0+16x80"}, {}, "0+14x80"),
    "MapChanged": ({INFO % "aa": "1x40 _x40", INFO % "bb": "_x40 1x40"}, {}, "_x80"),
    "RecordingFailed": ({"pneuforce_recording_failed": ONE}, {}, ZERO),
    "EventLogFailed": ({"pneuforce_event_log_failed": ONE}, {}, ZERO),
    "EventLogShorter": ({"pneuforce_event_log_records": STEP_DOWN}, {}, "899x40 900x40"),
    "EventLogRewritten": (
        {HEAD % "aa": "1x40 _x40", HEAD % "bb": "_x40 1x40"},
        {"records": "900"},
        "_x80",
    ),
}
CASES |= {
    f"{server}Certificate{event}": (
        {f"pneuforce_{metric}_certificate_left_seconds": "-1x80"},
        {},
        "2592001x80",
    )
    for server, metric in (("Web", "web"), ("ModbusTls", "modbus_tls"), ("Mqtt", "mqtt"))
    for event in ("Expires", "Expired")
}
CASES |= {
    f"MaintenanceRequired {bit.name}": (
        {f'pneuforce_maintenance_cause{{cause="{bit.name}"}}': ONE},
        {"cause": bit.name},
        ZERO,
    )
    for bit in MAINTENANCE_CAUSES.bits
}
CASES |= {
    key: (
        {f'pneuforce_fault_active{{code="{code}",fault="f"}}': "0x40 1x40"},
        {"code": code, "fault": "f"},
        ZERO,
    )
    for key, rule in BY_KEY.items()
    if (code := rule.labels.get("code"))
}


def with_target(series):
    """Return a series with the labels that Prometheus adds to each sample of a target."""
    name, _, labels = series.partition("{")
    target = ",".join(f'{key}="{value}"' for key, value in TARGET.items())
    return f"{name}{{{target}{',' if labels else '}'}{labels}"


def rule_test(series, fired):
    """Return a test for promtool: after 20 minutes, exactly the alerts `fired` (key, labels) fire."""
    found = {rule.name: [] for rule in RULES}
    for key, labels in fired.items():
        rule = BY_KEY[key]
        annotations = {"summary": f"{TARGET['instance']}: {rule.summary}", "remedy": rule.remedy}
        all_labels = TARGET | {"severity": rule.severity} | labels
        found[rule.name].append({"exp_labels": all_labels, "exp_annotations": annotations})
    return {
        "interval": INTERVAL,
        "input_series": [{"series": with_target(key), "values": values} for key, values in series.items()],
        "alert_rule_test": [
            {"eval_time": "20m", "alertname": name, "exp_alerts": alerts} for name, alerts in found.items()
        ],
    }


def promtool(*words):
    return subprocess.run([PROMTOOL, *words], capture_output=True, text=True, timeout=600, check=False)


@pytest.fixture
def rules(tmp_path):
    file = tmp_path / "pneuforce.rules.yml"
    file.write_text(prometheus_rules.render(), encoding="utf-8")
    return file


def check_alerts(rules, series, fired):
    """Check that exactly these alerts fire. One call has all series, because each call takes 1 s."""
    file = rules.with_name("tests.yml")
    tests = {
        "rule_files": [str(rules)],
        "evaluation_interval": INTERVAL,
        "tests": [rule_test(series, fired)],
    }
    file.write_text(json.dumps(tests, ensure_ascii=False), encoding="utf-8")
    done = promtool("test", "rules", str(file))
    assert done.returncode == 0, done.stdout + done.stderr


@NEEDS_PROMETHEUS
def test_each_alert_fires_with_its_remedy(rules):
    series = {key: values for case in CASES.values() for key, values in case[0].items()}
    check_alerts(rules, series, {name: labels for name, (_, labels, _) in CASES.items()})


@NEEDS_PROMETHEUS
def test_no_alert_fires_below_its_limit(rules):
    series = {key: quiet for series, _, quiet in CASES.values() for key in series}
    check_alerts(rules, series, {})


@NEEDS_PROMETHEUS
def test_only_a_warning_fires_before_the_end_of_a_certificate(rules):
    series = {f"pneuforce_{server}_certificate_left_seconds": ONE for server in ("web", "modbus_tls", "mqtt")}
    fired = ("WebCertificateExpires", "ModbusTlsCertificateExpires", "MqttCertificateExpires")
    check_alerts(rules, series, {key: {} for key in fired})


@NEEDS_PROMETHEUS
def test_no_alert_fires_in_normal_operation(rules):
    series = {
        "pneuforce_samples_total": "0+7500x80",
        "pneuforce_lost_samples_total": "0+7x80",
        INFO % "aa": ONE,
        HEAD % "aa": "1x40 _x40",
        HEAD.replace("900", "901") % "bb": "_x40 1x40",
    }
    check_alerts(rules, series, {})


@NEEDS_PROMETHEUS
def test_promtool_accepts_the_rules(rules):
    done = promtool("check", "rules", str(rules))
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{len(RULES)} rules found" in done.stdout


def test_each_alert_has_a_test_a_summary_and_a_remedy():
    assert CASES.keys() == BY_KEY.keys()
    assert all(rule.summary and rule.remedy for rule in RULES)


def queries():
    """Return the queries of the rules and of the dashboard."""
    panels = json.loads(grafana_dashboard.render())["panels"]
    return [rule.condition for rule in RULES] + [t["expr"] for panel in panels for t in panel["targets"]]


def test_the_queries_use_only_metrics_that_exist():
    known = {metric.full_name for metric in METRICS if metric.type is not MetricType.HISTOGRAM}
    histograms = [metric.full_name for metric in METRICS if metric.type is MetricType.HISTOGRAM]
    known |= {f"{name}_{part}" for name in histograms for part in ("bucket", "sum", "count")}
    used = {name for query in queries() for name in re.findall(r"pneuforce_\w+", query)}
    assert used - known == set()
    assert len(used) > 30


@NEEDS_PROMETHEUS
def test_the_queries_of_the_dashboard_are_valid(tmp_path):
    expressions = [
        query.replace("$__rate_interval", "1m").replace("$instance", "rig-1:8080") for query in queries()
    ]
    rules = [{"record": f"query:{number}", "expr": text} for number, text in enumerate(expressions)]
    file = tmp_path / "queries.yml"
    file.write_text(json.dumps({"groups": [{"name": "queries", "rules": rules}]}))
    done = promtool("check", "rules", str(file))
    assert done.returncode == 0, done.stdout + done.stderr


def test_no_panels_of_the_dashboard_overlap():
    panels = json.loads(grafana_dashboard.render())["panels"]
    cells = [
        (x, y)
        for panel in panels
        for x in range(panel["gridPos"]["x"], panel["gridPos"]["x"] + panel["gridPos"]["w"])
        for y in range(panel["gridPos"]["y"], panel["gridPos"]["y"] + panel["gridPos"]["h"])
    ]
    assert len(cells) == len(set(cells))
    assert max(x for x, _ in cells) == 23
    assert len({panel["id"] for panel in panels}) == len(panels)


def test_the_page_lists_each_metric_with_its_labels_and_each_alert():
    page = metrics_page.render()
    listed = re.findall(r"^\| `(pneuforce_\w+)` \| (\w+) \| ([^|]*) \|", page, re.MULTILINE)
    expected = [(metric.full_name, str(metric.type)) for metric in METRICS]
    assert [(name, kind) for name, kind, _ in listed] == expected
    labels = {name: re.findall(r"`(\w+)`", cell) for name, _, cell in listed}
    assert labels["pneuforce_event_log_info"] == ["records", "head"]
    assert labels["pneuforce_faults_total"] == ["code", "fault"]
    assert {rule.name for rule in RULES} <= set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE))
    assert VIEWS["metrics"].path == "docs/reference/metrics.md"
