"""Tests of the text of the metrics, for given entries of the instrument."""

import math
import subprocess

import pytest
from prometheus_client.openmetrics.parser import text_string_to_metric_families as parse_openmetrics
from prometheus_client.parser import text_string_to_metric_families as parse_text

from pneuforce.instrument.core.event_counts import EventCounts
from pneuforce.instrument.core.snapshot import Snapshot
from pneuforce.instrument.service.host.command_gaps import CommandGaps
from pneuforce.registers.codes import FAULTS
from pneuforce.registers.metric import MetricType
from pneuforce.registers.metrics import METRICS
from pneuforce.web.browser_feed import SNAPSHOT_TIMEOUT_S, BrowserFeed
from pneuforce.web.metrics import metrics_text, reading_of
from tests.prometheus_tools import NEEDS_PROMETHEUS, PROMTOOL
from tests.web.entries import header, health, real_snapshot, snapshot

OPENMETRICS = "application/openmetrics-text;version=1.0.0"
HEAD = "ab" * 32
ALL_FAULTS = [code for code in FAULTS.names if code]


def gaps():
    found = CommandGaps()
    for time_s in (0.0, 0.05, 0.1, 0.6, 9.0):
        found.sent(time_s)
    return found.values()


def counts():
    found = EventCounts(trips=2, vents=3)
    found.count_faults((), (5, 40))
    found.count_rejected_write("lease")
    found.count_rejected_write('illegal "value"\n')
    return found.values()


SECTIONS = {
    "rig": {"samples": 1000, "lost_frames": 2, "up": True, "command_gaps": gaps(), "firmware": "1.5"},
    "counts": counts(),
    "modbus_tcp": {"requests": 7, "evicted": 1, "clients": [{"address": "10.0.0.1"}]},
    "modbus_rtu": {"requests": 9, "up": False},
    "can": {"sent": 5, "received": 6, "error_frames": 1, "up": True},
    "recording": {"on": False, "trouble": "the disk is full"},
    "events": {"trouble": "", "records": 12, "head": HEAD},
    "started_utc_s": 1.8e9,
}


def feed(*entries):
    found = BrowserFeed()
    for entry in entries:
        found.process(entry)
    return found


def measuring(**changes):
    """Return the feed of an instrument that holds a balloon."""
    plain = real_snapshot()[1] | {"force_n": 1.25} | changes
    return feed(header(), snapshot(100.0, **plain), health(100.0, **SECTIONS))


def samples_of(found, accept=""):
    """Return the value of each sample by name and label values. The labels are in alphabetical order."""
    text = metrics_text(reading_of(found), accept).text.decode()
    families = (parse_openmetrics if accept else parse_text)(text)
    samples = [sample for family in families for sample in family.samples]
    return {(s.name, *(value for _, value in sorted(s.labels.items()))): s.value for s in samples}


def test_values_have_base_units():
    samples = samples_of(measuring(pressure_kpa=8.5))
    assert samples["pneuforce_force_newtons",] == 1.25
    assert samples["pneuforce_pressure_pascals",] == 8500.0
    assert samples["pneuforce_start_time_seconds",] == 1.8e9


def test_a_force_that_is_not_valid_has_no_sample():
    samples = samples_of(measuring(force_n=None))
    assert ("pneuforce_force_newtons",) not in samples
    assert not any(math.isnan(value) for value in samples.values())


@pytest.mark.parametrize("lost", ["disconnected", "silent", "not reached", "without health"])
def test_without_current_values_the_only_sample_is_that_the_instrument_is_down(lost):
    found = measuring()
    if lost == "disconnected":
        found.disconnected("The instrument is not running.")
    elif lost == "silent":
        found.due_messages(100.0 + SNAPSHOT_TIMEOUT_S + 0.1)
    elif lost == "not reached":
        found = BrowserFeed()
    else:
        found = feed(header(), snapshot(100.0, **real_snapshot()[1]))
    assert samples_of(found) == {("pneuforce_instrument_up",): 0.0}


def test_one_state_is_1_and_all_status_bits_have_a_sample():
    samples = samples_of(measuring(status=["holding", "leak"]))
    states = {key[1]: value for key, value in samples.items() if key[0] == "pneuforce_state"}
    bits = {key[1]: value for key, value in samples.items() if key[0] == "pneuforce_status"}
    assert {name for name, value in states.items() if value} == {"holding"}
    assert (len(states), len(bits)) == (7, 32)
    assert {name for name, value in bits.items() if value} == {"holding", "leak"}


def test_each_fault_has_a_count_from_the_start_on():
    samples = samples_of(measuring(faults=[40]))
    found = {int(key[1]): value for key, value in samples.items() if key[0] == "pneuforce_faults_total"}
    assert {code for code, count in found.items() if count} == {5, 40}
    assert sorted(found) == ALL_FAULTS
    assert samples["pneuforce_faults_total", "5", "burst"] == 1
    assert samples["pneuforce_fault_active", "40", "force_limit"] == 1
    assert samples["pneuforce_fault_active", "5", "burst"] == 0


def test_a_reason_of_a_bus_has_a_series_after_its_first_rejection():
    samples = samples_of(measuring())
    assert samples["pneuforce_rejected_writes_total", "lease"] == 1
    assert samples["pneuforce_rejected_writes_total", "state"] == 0
    assert samples["pneuforce_rejected_writes_total", 'illegal "value"\n'] == 1


def test_the_histogram_is_cumulative():
    samples = samples_of(measuring())
    assert samples["pneuforce_command_gap_seconds_bucket", "0.055"] == 2
    assert samples["pneuforce_command_gap_seconds_bucket", "0.5"] == 3
    assert samples["pneuforce_command_gap_seconds_bucket", "+Inf"] == 4
    assert samples["pneuforce_command_gap_seconds_count",] == 4
    assert samples["pneuforce_command_gap_seconds_sum",] == pytest.approx(9.0)


def test_buses_that_are_disabled_have_no_samples():
    sections = SECTIONS | {"modbus_tcp": None, "modbus_rtu": None, "can": None, "events": None}
    found = feed(header(), snapshot(100.0, **real_snapshot()[1]), health(100.0, **sections))
    names = {key[0] for key in samples_of(found)}
    assert not [name for name in names if "modbus" in name or "can_" in name or "event_log" in name]
    assert samples_of(measuring())["pneuforce_modbus_requests_total", "rtu"] == 9
    assert samples_of(measuring())["pneuforce_modbus_clients", "tcp"] == 1


def test_the_head_of_the_event_log_is_an_info_metric():
    samples = samples_of(measuring(), OPENMETRICS)
    assert samples["pneuforce_event_log_info", HEAD, "12"] == 1
    empty = SECTIONS | {"events": {"trouble": "", "records": 0, "head": "00" * 32}}
    found = feed(header(), snapshot(100.0, **real_snapshot()[1]), health(100.0, **empty))
    assert "pneuforce_event_log_info" not in {key[0] for key in samples_of(found)}


def test_a_failed_recording_and_the_date_of_the_calibration_have_samples():
    samples = samples_of(measuring(calibration_date=20270131))
    assert samples["pneuforce_recording_failed",] == 1
    assert samples["pneuforce_event_log_failed",] == 0
    assert samples["pneuforce_calibration_time_seconds",] == 1801353600
    assert ("pneuforce_calibration_time_seconds",) not in samples_of(measuring(calibration_date=0))


@pytest.mark.parametrize(
    ("accept", "media_type", "end"),
    [
        ("", "text/plain; version=0.0.4", False),
        ("text/html", "text/plain; version=0.0.4", False),
        (
            f"{OPENMETRICS},text/plain;version=0.0.4;q=0.5",
            "application/openmetrics-text; version=1.0.0",
            True,
        ),
    ],
)
def test_the_format_is_the_one_that_is_requested(accept, media_type, end):
    text, actual = metrics_text(reading_of(measuring()), accept)
    assert actual.startswith(media_type)
    assert text.decode().endswith("# EOF\n") == end


@pytest.mark.parametrize("accept", ["", OPENMETRICS])
def test_each_metric_of_the_table_is_in_the_text_also_without_a_sample(accept):
    for found in (measuring(), BrowserFeed()):
        text = metrics_text(reading_of(found), accept).text.decode()
        for metric in METRICS:
            name = f"pneuforce_{metric.name}" if accept else metric.full_name
            assert f"# HELP {name} " in text
    names = [metric.name for metric in METRICS]
    assert len(names) == len(set(names))


def test_each_quantity_of_the_table_is_in_the_snapshot():
    paths = [metric.source for metric in METRICS if isinstance(metric.source, str)]
    quantities = {path.split(".")[1] for path in paths if path.startswith("snapshot.")}
    assert quantities <= set(Snapshot._fields)


def test_info_and_histogram_metrics_have_the_sources_that_their_types_need():
    for metric in METRICS:
        if metric.type is MetricType.INFO:
            assert isinstance(metric.source, dict)
        elif isinstance(metric.source, dict):
            assert len(metric.labels) == 1


@NEEDS_PROMETHEUS
@pytest.mark.parametrize("found", [measuring(), BrowserFeed()], ids=["measuring", "not reached"])
def test_promtool_finds_nothing_to_improve(found):
    text = metrics_text(reading_of(found), "").text
    done = subprocess.run(
        [PROMTOOL, "check", "metrics"], input=text, capture_output=True, timeout=600, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")
