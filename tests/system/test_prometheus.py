"""Tests with a real Prometheus that reads a running instrument, raises alerts, and is a witness of its log.

Prometheus also contains the observations of another instrument over several weeks, written by promtool.
"""

import json
import re
import subprocess
import time
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from signal import SIGTERM
from urllib.parse import urlencode
from urllib.request import urlopen

import pytest

from pneuforce.registers.advice import FAULT_ADVICE
from pneuforce.registers.codes import FAULTS
from pneuforce.registers.metrics import METRICS
from pneuforce.registers.views import grafana_dashboard, prometheus_rules
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import free_port, start, toml
from tests.command_runner import pneuforce
from tests.instrument.audit.event_log_files import make_log, verify_log
from tests.prometheus_tools import NEEDS_PROMETHEUS, PROMETHEUS, PROMTOOL
from tests.registers.modbus.serial_lines import Cable
from tests.system.waiting import wait_for

pytestmark = NEEDS_PROMETHEUS
BURST = 5
OLD_INSTANCE = "old:8080"
WEEK_S = 7 * 86_400
#: Metrics without a sample in this test: TLS and MQTT are disabled, the calibration has no date, and no
#: ambient pressure is written.
ABSENT = {
    "pneuforce_modbus_tls_certificate_left_seconds",
    "pneuforce_web_certificate_left_seconds",
    "pneuforce_mqtt_certificate_left_seconds",
    "pneuforce_mqtt_connected",
    "pneuforce_mqtt_stored_records",
    "pneuforce_mqtt_lost_records_total",
    "pneuforce_ambient_age_seconds",
    "pneuforce_modbus_tls_failed_handshakes_total",
    "pneuforce_calibration_time_seconds",
}
CONFIGURATION = """\
global: {{scrape_interval: 500ms, evaluation_interval: 500ms}}
rule_files: [{rules}]
scrape_configs:
  - job_name: pneuforce
    static_configs: [{{targets: ["127.0.0.1:{port}"]}}]
"""


class Server:
    """Queries to a running Prometheus."""

    def __init__(self, port, instance):
        self.url, self.instance = f"http://127.0.0.1:{port}", instance

    def get(self, kind, **parameters):
        with urlopen(f"{self.url}/api/v1/{kind}?{urlencode(parameters)}", timeout=60) as response:
            return json.load(response)["data"]

    def values(self, query):
        """Return the value of each series of an instant query, by its labels without the target."""
        found = self.get("query", query=query)["result"]
        return {
            tuple(v for k, v in sorted(one["metric"].items()) if k not in ("__name__", "instance", "job")): (
                float(one["value"][1])
            )
            for one in found
        }

    def wait_for(self, query, value=1.0, labels=()):
        wait_for(lambda: self.values(query).get(labels), lambda found: found == value)


@contextmanager
def prometheus(folder, web_port):
    """Run Prometheus. Yield its address when it is ready."""
    port = free_port()
    (folder / "pneuforce.rules.yml").write_text(prometheus_rules.render())
    rules = json.dumps(str(folder / "pneuforce.rules.yml"))
    (folder / "prometheus.yml").write_text(CONFIGURATION.format(rules=rules, port=web_port))
    process = subprocess.Popen(
        [
            PROMETHEUS,
            f"--config.file={folder / 'prometheus.yml'}",
            f"--storage.tsdb.path={folder / 'data'}",
            "--storage.tsdb.retention.time=10y",
            f"--web.listen-address=127.0.0.1:{port}",
        ],
        stdout=subprocess.DEVNULL,
        stderr=(folder / "prometheus.log").open("w"),
    )
    try:
        wait_for(lambda: is_ready(port), bool)
        yield port
    finally:
        process.kill()
        process.wait()


def is_ready(port):
    try:
        return urlopen(f"http://127.0.0.1:{port}/-/ready", timeout=1).status == 200
    except OSError:
        return False


def write_history(folder):
    """Write a log of another instrument, and its heads in three weeks into the data of Prometheus."""
    now_s = time.time()
    lines = ["# TYPE pneuforce_event_log_info gauge"]
    log = folder / "old.sqlite"
    for week in (5, 3, 2):
        chain = verify_log(make_log(log, [week]))
        labels = f'instance="{OLD_INSTANCE}",job="pneuforce",records="{chain.records}",head="{chain.head}"'
        lines += [
            f"pneuforce_event_log_info{{{labels}}} 1 {now_s - week * WEEK_S + 15 * scrape:.3f}"
            for scrape in range(4)
        ]
    make_log(log, [99])
    (folder / "history").write_text("\n".join([*lines, "# EOF\n"]))
    subprocess.run(
        [
            PROMTOOL,
            "tsdb",
            "create-blocks-from",
            "openmetrics",
            str(folder / "history"),
            str(folder / "data"),
        ],
        check=True,
        capture_output=True,
        timeout=60,
    )
    return log


class Monitored:
    """Instrument that Prometheus reads."""

    def __init__(self, folder, children):
        self._folder, self._children = folder, children
        line = Cable()
        children.callback(line.unplug)
        self.log, self.old_log = folder / "events.sqlite", write_history(folder)
        self._tables = {
            "rig": {"port": str(folder / "rig")},
            "modbus": {"port": free_port()},
            "modbus_rtu": {"enabled": True, "port": line.ports[0]},
            "rdt": {"enabled": True, "port": free_port()},
            "events": {"file": str(self.log)},
            "local": {"socket": str(folder / "pneuforce.sock")},
            "web": {"enabled": True, "port": free_port()},
        }
        self.port = self._tables["web"]["port"]
        self.stack = start(children, folder / "rig", ["--no-hand", "--seed", "1"], self._tables)
        self._can = {"enabled": True, "interface": "socketcand", "port": self.stack.can_port}
        port = children.enter_context(prometheus(folder, self.port))
        self.server = Server(port, f"127.0.0.1:{self.port}")
        self.rig = LiveRig(self.stack)

    def restart(self):
        self.stack.host.send(SIGTERM)
        wait_for(lambda: self.stack.host.running, lambda running: not running)
        host = ChildProcess("instrument", ["pneuforce", "run", "--config", "/dev/stdin"])
        self._children.enter_context(host)
        host.write_stdin(toml(self._tables | {"can": self._can}))
        host.ready()
        self.stack = replace(self.stack, host=host)
        self.rig = LiveRig(self.stack)

    def verify(self, *options):
        """Return the exit code and the JSON output of `log verify --witness`."""
        done = pneuforce("log", "verify", "--json", "--witness", self.server.url, *options)
        assert done.stderr == ""
        return done.returncode, json.loads(done.stdout)


@pytest.fixture(scope="module")
def monitored(tmp_path_factory):
    with ExitStack() as children:
        yield Monitored(tmp_path_factory.mktemp("prometheus"), children)


def test_prometheus_follows_a_trip_and_a_restart_and_is_a_witness_of_both(monitored, tmp_path):
    server = monitored.server
    server.wait_for("pneuforce_instrument_up")
    monitored.rig.inflate(8.0)
    server.wait_for('pneuforce_state{state="holding"}', labels=("holding",))
    check_metrics(monitored)
    check_buses(server)
    with monitored.rig.inject_fault("burst"):
        server.wait_for("pneuforce_trips_total")
    assert server.values("pneuforce_faults_total > 0") == {(str(BURST), FAULTS.names[BURST]): 1.0}
    wait_for(lambda: server.get("alerts")["alerts"], lambda alerts: is_firing(alerts, FAULT_ADVICE[BURST].do))
    check_queries(server)

    monitored.restart()
    server.wait_for("changes(pneuforce_start_time_seconds[5m])")
    server.wait_for("resets(pneuforce_samples_total[5m])")
    assert server.values("pneuforce_event_log_records")[()] >= 10

    wait_for(lambda: monitored.verify("--instance", server.instance, "--file", monitored.log), is_agreed)
    check_forgery(monitored, tmp_path / "forged")


def check_metrics(monitored):
    """Check that each metric has a sample."""
    with urlopen(f"http://127.0.0.1:{monitored.port}/metrics") as response:
        text = response.read().decode()
    present = set(re.findall(r"^(pneuforce_\w+)[ {]", text, re.MULTILINE))
    names = {metric.full_name for metric in METRICS}
    missing = {name for name in names if not any(found.startswith(name) for found in present)}
    assert missing == ABSENT


def check_buses(server):
    """Check that the metrics of CAN and of Modbus RTU follow the running buses."""
    server.wait_for("pneuforce_can_up")
    server.wait_for("pneuforce_modbus_rtu_up")
    server.wait_for(
        'increase(pneuforce_can_frames_total{direction="sent"}[10s]) > bool 100', labels=("sent",)
    )
    assert server.values("pneuforce_can_error_frames_total") == {(): 0.0}


def check_queries(server):
    """Check that Prometheus answers each query of the dashboard, and most with a value."""
    panels = json.loads(grafana_dashboard.render())["panels"]
    queries = [target["expr"] for panel in panels for target in panel["targets"]]
    texts = [q.replace("$instance", server.instance).replace("$__rate_interval", "1m") for q in queries]
    answered = [text for text in texts if server.get("query", query=text)["result"]]
    # A tripped instrument has no force and no setpoint, and has rejected no write.
    unanswered = {re.search(r"pneuforce_\w+", text)[0] for text in texts if text not in answered}
    assert unanswered == {
        "pneuforce_force_newtons",
        "pneuforce_setpoint_pascals",
        "pneuforce_baseline_pressure_pascals",
        "pneuforce_rejected_writes_total",
    }


def is_firing(alerts, remedy):
    return any(a["state"] == "firing" and a["annotations"]["remedy"] == remedy for a in alerts)


def is_agreed(result):
    code, answer = result
    return code == 0 and not answer["witness"]["contradicts"] and not answer["witness"]["missing"]


def check_forgery(monitored, forged):
    """Check that the witness contradicts a log that is intact but has other records."""
    code, answer = monitored.verify("--instance", monitored.server.instance, "--file", make_log(forged, [1]))
    assert (code, answer["ok"]) == (1, False)
    assert answer["witness"]["contradicts"]


def test_an_instrument_must_be_named_if_prometheus_reads_several(monitored):
    monitored.server.wait_for("pneuforce_instrument_up")
    code, answer = monitored.verify("--file", monitored.old_log)
    assert code == 2
    assert OLD_INSTANCE in answer["message"]
    assert monitored.server.instance in answer["message"]
    assert monitored.verify("--file", monitored.old_log, "--instance", "unknown:1")[0] == 2


def test_the_observations_of_several_weeks_are_compared(monitored, tmp_path):
    code, answer = monitored.verify("--file", monitored.old_log, "--instance", OLD_INSTANCE)
    assert (code, answer["records"], answer["witness"]["contradicts"]) == (0, 4, [])
    assert answer["witness"]["agrees"].startswith("3 observed heads")
    assert [text.split()[0] for text in answer["witness"]["missing"]] == ["1", "2"]
    rewritten = make_log(tmp_path / "rewritten", [5, 88, 2, 99])
    code, answer = monitored.verify("--file", rewritten, "--instance", OLD_INSTANCE)
    assert (code, len(answer["witness"]["contradicts"])) == (1, 2)


def test_the_comparison_is_printed_in_words(monitored):
    done = pneuforce(
        *("log", "verify", "--file", monitored.old_log, "--witness", monitored.server.url),
        *("--instance", OLD_INSTANCE),
    )
    assert done.returncode == 0
    words = [line.split()[2] for line in done.stdout.splitlines()[1:]]
    assert words == ["agrees:", "missing:", "missing:"]
