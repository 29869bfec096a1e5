"""Tests of the event log of a running instrument, read with the commands for users."""

import json
import math
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import ExitStack, closing, suppress

import pytest

from pneuforce.instrument.audit.wording import describe_record
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.registers.modbus.client import ModbusClientError
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import free_port, start, toml
from tests.command_runner import pneuforce
from tests.instrument.audit.event_log_files import make_log, verify_log


def log(*words):
    return pneuforce("log", *words)


def records(file):
    shown = log("show", "--file", file, "--json", "--last", "0")
    assert shown.returncode == 0, shown.stderr
    return [json.loads(line) for line in shown.stdout.splitlines()]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return the log of a run with a hold, an invalid write, a removed and restored folder, and SIGTERM."""
    folder = tmp_path_factory.mktemp("finished")
    logs = folder / "logs"
    logs.mkdir()
    with ExitStack() as children:
        parts = start(children, folder / "rig", ["--no-hand"], {"events": {"file": str(logs / "log")}})
        rig = LiveRig(parts)
        rig.inflate(8.0)
        with suppress(ModbusClientError):
            rig.write("setpoint_requested", 99.0)
        time.sleep(0.3)
        while_running = records(logs / "log")
        assert log("copy", folder / "copied", "--file", logs / "log").returncode == 0
        shutil.move(logs, folder / "gone")
        rig.wait_for(lambda registers: "maintenance_required" in registers["status"])
        measured = rig.wait_for(lambda registers: not math.isnan(registers["force"]))
        rig.write("force_limit", 2.5)
        shutil.move(folder / "gone", logs)
        rig.wait_for(lambda registers: "maintenance_required" not in registers["status"])
        parts.host.send(signal.SIGTERM)
        while parts.host.running:
            time.sleep(0.01)
    (folder / "journal").write_text("\n".join(parts.host.stderr_lines))
    return logs / "log", while_running, measured


def test_the_log_contains_the_run_from_start_to_stop(finished):
    file, *_ = finished
    run = records(file)
    assert [record["number"] for record in run] == list(range(1, len(run) + 1))
    assert (run[0]["kind"], run[-1]["kind"], run[-1]["why"]) == ("start", "stop", "stop requested")
    assert {"version", "map_hash", "configuration_hash"} <= set(run[0])
    states = [record["is"] for record in run if record["kind"] == "state"]
    assert states[:4] == ["vented", "inflating", "settling", "holding"]
    writes = [record["values"] for record in run if record["kind"] == "write"]
    assert {"setpoint_requested_kpa": ["nan", 8.0]} in writes
    assert {"mode": ["vent", "hold"]} in writes
    (rejected,) = (record for record in run if record["kind"] == "request")
    assert (rejected["who"], rejected["result"]) == ("modbus_tcp 127.0.0.1", "illegal_value")


def test_the_log_is_readable_while_it_is_written(finished):
    _, while_running, _ = finished
    assert while_running[-1]["result"] == "illegal_value"


def test_a_copy_of_the_log_of_a_running_instrument_is_verified(finished):
    file, while_running, _ = finished
    copy = file.parents[1] / "copied"
    assert records(copy)[: len(while_running)] == while_running
    assert log("verify", "--file", file, "--head", verify_log(copy).head).returncode == 0


def test_measuring_continues_without_the_log_and_no_record_is_lost(finished):
    file, _, measured = finished
    assert measured["state"] == "holding"
    assert measured["force"] == 0.0
    assert {"force_limit_n": [5.0, 2.5]} in [r["values"] for r in records(file) if r["kind"] == "write"]


def test_an_intact_log_is_verified_against_a_noted_head(finished):
    file, while_running, _ = finished
    verified = log("verify", "--file", file, "--head", while_running[-1]["digest"])
    assert verified.returncode == 0, verified.stdout
    assert re.fullmatch(
        r"\d+ records from \S+Z to \S+Z, unbroken, including the noted head, head [0-9a-f]{64}\n",
        verified.stdout,
    )


def test_the_log_is_verified_against_the_anchors_in_the_journal(finished, tmp_path):
    file = finished[0]
    journal = file.parents[1] / "journal"
    verified = log("verify", "--file", file, "--anchors", journal, "--json")
    assert verified.returncode == 0, verified.stdout
    assert json.loads(verified.stdout)["anchors"] >= 2
    cut = shutil.copy(file, tmp_path / "log")
    with closing(sqlite3.connect(cut)) as db:
        db.execute("DROP TRIGGER no_delete")
        db.execute("DELETE FROM records WHERE number = (SELECT max(number) FROM records)")
        db.commit()
    assert log("verify", "--file", cut).returncode == 0
    assert log("verify", "--file", cut, "--anchors", journal).returncode == 1


def test_a_changed_record_is_reported_with_exit_code_1(finished, tmp_path):
    file = shutil.copy(finished[0], tmp_path / "log")
    with closing(sqlite3.connect(file)) as db:
        db.execute("DROP TRIGGER no_update")
        db.execute("UPDATE records SET body = replace(body, '8.0', '3.0') WHERE body LIKE '%nan%'")
        db.commit()
    verified = log("verify", "--file", file)
    assert verified.returncode == 1
    assert re.search(r": record \d+ does not match its digest", verified.stdout)


def test_the_result_of_the_verification_is_available_as_json(finished, tmp_path):
    result = json.loads(log("verify", "--file", finished[0], "--json").stdout)
    assert (result["ok"], result["head"]) == (True, verify_log(finished[0]).head)
    (tmp_path / "notes").write_text("notes\n" * 1000)
    verified = log("verify", "--file", tmp_path / "notes", "--json")
    result = json.loads(verified.stdout)
    assert (verified.returncode, result["ok"]) == (1, False)
    assert "is not an event log" in result["message"]


def test_repetitions_are_described_with_their_number():
    counted = {"kind": "write", "values": {"mode": [0, 0]}, "result": "accepted"}
    fields = {
        "kind": "repeated",
        "times": 1,
        "since": "2027-01-31T08:00:00Z",
        "until": "2027-01-31T08:00:01Z",
    }
    assert describe_record({**fields, "of": counted}).startswith("repeated once (")
    assert describe_record({**fields, "times": 2, "of": counted}).startswith("repeated 2 times (")


def test_a_truncated_log_lacks_the_noted_head(finished, tmp_path):
    short = make_log(tmp_path / "log", range(3))
    verified = log("verify", "--file", short, "--head", verify_log(finished[0]).head)
    assert (verified.returncode, "changed or removed" in verified.stdout) == (1, True)


def test_a_file_without_a_record_fails_the_verification(tmp_path):
    (tmp_path / "emptied").touch()
    for file in (tmp_path / "emptied", make_log(tmp_path / "log", range(0))):
        verified = log("verify", "--file", file)
        assert (verified.returncode, "no record" in verified.stdout) == (1, True)


def test_the_table_describes_the_records(finished):
    shown = log("show", "--file", finished[0], "--last", "0").stdout
    assert re.search(r"modbus_tcp 127\.0\.0\.1 +accepted +setpoint_requested nan → 8 kPa", shown)
    assert re.search(r"rejected: illegal_value +request setpoint_requested 99", shown)
    assert "state: settling → holding" in shown
    assert "stop: stop requested" in shown
    assert len(log("show", "--file", finished[0], "--last", "2").stdout.splitlines()) == 3


def test_since_selects_the_records_from_a_time_on(finished):
    run = records(finished[0])
    shown = log("show", "--file", finished[0], "--json", "--since", run[3]["at"][:19])
    assert json.loads(shown.stdout.splitlines()[-1]) == run[-1]
    assert log("show", "--file", finished[0], "--json", "--since", "2100-01-01").stdout == ""


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("show", "--file", "/nowhere/log"), "does not exist"),
        (("verify", "--file", "/nowhere/log"), "does not exist"),
        (("show",), "--config"),
        (("copy", "/nowhere/copy", "--file", "{log}"), "cannot be written"),
        (("verify", "--file", "{log}", "--head", "abc"), "64 hexadecimal digits"),
        (("show", "--file", "{log}", "--config", "x"), "--file"),
        (("show", "--config", "{config}"), "events"),
        (("show", "--file", "{config}"), "is not an event log"),
        (("show", "--file", "{log}", "--since", "gestern"), "2027-01-31T08:00:00"),
    ],
)
def test_invalid_arguments_are_reported_without_a_traceback(finished, tmp_path, words, message):
    config = tmp_path / "instrument.toml"
    config.write_text('[events]\nfile = ""\n')
    rejected = log(*(word.format(log=finished[0], config=config) for word in words))
    assert (rejected.returncode, message in rejected.stderr, "Traceback" in rejected.stderr) == (
        2,
        True,
        False,
    )


def test_the_instrument_does_not_start_with_another_file_as_event_log(tmp_path):
    (tmp_path / "notes").write_text("notes\n" * 1000)
    config = tmp_path / "instrument.toml"
    config.write_text(f'[rig]\nport = "{tmp_path}/no"\n[events]\nfile = "notes"\n')
    rejected = pneuforce("run", "--config", config)
    assert rejected.returncode == 78
    assert "not an event log" in rejected.stderr.splitlines()[-1]


def test_follow_prints_added_records(tmp_path):
    file = make_log(tmp_path / "log", range(2))
    words = [sys.executable, "-m", "pneuforce", "log", "show", "--file", str(file), "--json", "--follow"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=os.environ) as following:
        lines = [following.stdout.readline() for _ in range(2)]
        make_log(file, range(2, 4))
        lines += [following.stdout.readline() for _ in range(2)]
        following.send_signal(signal.SIGINT)
        assert following.wait(60) == 0
    assert [json.loads(line)["which"] for line in lines] == [0, 1, 2, 3]


def test_the_shutdown_does_not_log_a_trip(tmp_path):
    """The host closes the port of the rig before it waits for the web process and the recorder to end."""
    with ExitStack() as children:
        link, config = str(tmp_path / "rig"), tmp_path / "i.toml"
        children.enter_context(ChildProcess("simulator", ["pneuforce", "sim", "run", "--link", link])).ready()
        tables = {"rig": {"port": link}, "modbus": {"port": free_port()}}
        config.write_text(toml({**tables, "web": {"enabled": True, "port": free_port()}}))
        words = ["pneuforce", "run", "--config", str(config), "--record", str(tmp_path / "a.recording")]
        host = children.enter_context(ChildProcess("instrument", words))
        host.ready()
        time.sleep(0.5)
        host.send(signal.SIGTERM)
        while host.running:
            time.sleep(0.01)
    run = records(tmp_path / "events.sqlite")
    assert run[-1]["kind"] == "stop"
    assert [record["is"] for record in run if record["kind"] == "state"][-1] == "vented"
    with open_recording(tmp_path / "a.recording") as recording:
        assert [*recording.events()][-1]["kind"] == "stop"
        assert recording.ending.how == EndReason.END
