"""The event log of a running instrument, read by the commands that users have."""

import json
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

from instrument.events.words import in_words
from instrument.tape.opening import opened
from instrument.tape.schema import How
from registers.modbus.client import PlcError
from tests.instrument.events.keeping import chain_of, written
from tests.typed import pneuforce
from teststand.children import Child
from teststand.rig import LiveRig
from teststand.stack import free_port, start, toml


def log(*words):
    return pneuforce("log", *words)


def records(file):
    shown = log("show", "--file", file, "--json", "--last", "0")
    assert shown.returncode == 0, shown.stderr
    return [json.loads(line) for line in shown.stdout.splitlines()]


@pytest.fixture(scope="module")
def lived(tmp_path_factory):
    """A log of a short life: a hold, a bad write, a folder that went and came back, SIGTERM."""
    folder = tmp_path_factory.mktemp("lived")
    kept = folder / "kept"
    kept.mkdir()
    with ExitStack() as children:
        parts = start(children, folder / "rig", ["--no-hand"], {"events": {"file": str(kept / "log")}})
        rig = LiveRig(parts)
        rig.inflate(8.0)
        with suppress(PlcError):
            rig.write("setpoint_requested", 99.0)
        time.sleep(0.3)
        while_running = records(kept / "log")
        shutil.move(kept, folder / "gone")
        rig.wait_for(lambda registers: "maintenance" in registers["status"])
        measured = rig.read()
        rig.write("force_limit", 2.5)
        shutil.move(folder / "gone", kept)
        rig.wait_for(lambda registers: "maintenance" not in registers["status"])
        parts.host.send(signal.SIGTERM)
        while parts.host.running:
            time.sleep(0.01)
    return kept / "log", while_running, measured


def test_the_life_of_an_instrument_can_be_read_from_start_to_stop(lived):
    file, *_ = lived
    told = records(file)
    assert [record["number"] for record in told] == list(range(1, len(told) + 1))
    assert (told[0]["kind"], told[-1]["kind"], told[-1]["why"]) == ("start", "stop", "asked to stop")
    assert {"version", "map_hash", "configuration_hash"} <= set(told[0])
    states = [record["is"] for record in told if record["kind"] == "state"]
    assert states[:4] == ["vented", "inflating", "settling", "holding"]
    writes = [record["values"] for record in told if record["kind"] == "write"]
    assert {"setpoint_requested_kpa": ["nan", 8.0]} in writes
    assert {"mode": ["vent", "hold"]} in writes
    (refused,) = (record for record in told if record["kind"] == "request")
    assert (refused["who"], refused["verdict"]) == ("modbus_tcp 127.0.0.1", "illegal_value")


def test_it_can_be_read_while_it_is_written(lived):
    _, while_running, _ = lived
    assert while_running[-1]["verdict"] == "illegal_value"


def test_measuring_goes_on_while_the_log_is_away_and_nothing_is_lost(lived):
    file, _, measured = lived
    assert measured["state"] == "holding"
    assert measured["force"] == 0.0
    assert {"force_limit_n": [5.0, 2.5]} in [r["values"] for r in records(file) if r["kind"] == "write"]


def test_a_whole_log_verifies_also_against_a_head_noted_earlier(lived):
    file, while_running, _ = lived
    verified = log("verify", "--file", file, "--head", while_running[-1]["seal"])
    assert verified.returncode == 0, verified.stdout
    assert re.fullmatch(
        r"\d+ records from \S+Z to \S+Z, unbroken, the noted head among them, head [0-9a-f]{64}\n",
        verified.stdout,
    )


def test_a_changed_record_is_named_and_the_exit_code_is_1(lived, tmp_path):
    file = shutil.copy(lived[0], tmp_path / "log")
    with closing(sqlite3.connect(file)) as db:
        db.execute("DROP TRIGGER no_update")
        db.execute("UPDATE records SET body = replace(body, '8.0', '3.0') WHERE body LIKE '%nan%'")
        db.commit()
    verified = log("verify", "--file", file)
    assert verified.returncode == 1
    assert re.search(r"NOT GOOD: record \d+ is not what was sealed", verified.stdout)


def test_a_program_is_told_whether_a_log_is_good(lived, tmp_path):
    told = json.loads(log("verify", "--file", lived[0], "--json").stdout)
    assert (told["good"], told["head"]) == (True, chain_of(lived[0]).head)
    (tmp_path / "notes").write_text("mine\n" * 1000)
    verified = log("verify", "--file", tmp_path / "notes", "--json")
    told = json.loads(verified.stdout)
    assert (verified.returncode, told["good"]) == (1, False)
    assert "is not an event log" in told["why"]


def test_what_came_once_more_is_told_in_words():
    of = {"kind": "write", "values": {"mode": [0, 0]}, "verdict": "accepted"}
    facts = {"kind": "repeated", "times": 1, "since": "2027-01-31T08:00:00Z", "until": "2027-01-31T08:00:01Z"}
    assert in_words({**facts, "of": of}).startswith("repeated once (")
    assert in_words({**facts, "times": 2, "of": of}).startswith("repeated 2 times (")


def test_a_log_that_was_cut_off_lacks_the_head(lived, tmp_path):
    short = written(tmp_path / "log", range(3))
    verified = log("verify", "--file", short, "--head", chain_of(lived[0]).head)
    assert (verified.returncode, "cut off" in verified.stdout) == (1, True)


def test_a_file_without_a_record_is_not_called_good(tmp_path):
    (tmp_path / "emptied").touch()
    for file in (tmp_path / "emptied", written(tmp_path / "log", range(0))):
        verified = log("verify", "--file", file)
        assert (verified.returncode, "NOT GOOD: it holds no record" in verified.stdout) == (1, True)


def test_the_table_says_it_in_words(lived):
    shown = log("show", "--file", lived[0], "--last", "0").stdout
    assert re.search(r"modbus_tcp 127\.0\.0\.1 +accepted +setpoint_requested_kpa nan → 8\b", shown)
    assert re.search(r"illegal_value +request 10 02 00 00 02 04 42 c6 00 00", shown)
    assert "state: settling → holding" in shown
    assert "stop: asked to stop" in shown
    assert len(log("show", "--file", lived[0], "--last", "2").stdout.splitlines()) == 3


def test_since_a_moment_shows_what_came_from_then_on(lived):
    told = records(lived[0])
    shown = log("show", "--file", lived[0], "--json", "--since", told[3]["at"][:19])
    assert json.loads(shown.stdout.splitlines()[-1]) == told[-1]
    assert log("show", "--file", lived[0], "--json", "--since", "2100-01-01").stdout == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("show", "--file", "/nowhere/log"), "no such file"),
        (("verify", "--file", "/nowhere/log"), "no such file"),
        (("verify", "--file", "{log}", "--head", "abc"), "64 hexadecimal digits"),
        (("show", "--file", "{log}", "--config", "x"), "give one of them"),
        (("show", "--config", "{config}"), "keeps no log"),
        (("show", "--file", "{config}"), "is not an event log"),
        (("show", "--file", "{log}", "--since", "gestern"), "2027-01-31T08:00:00"),
    ],
)
def test_what_cannot_be_read_is_a_sentence(lived, tmp_path, words, said):
    config = tmp_path / "instrument.toml"
    config.write_text('[events]\nfile = ""\n')
    refused = log(*(word.format(log=lived[0], config=config) for word in words))
    assert (refused.returncode, said in refused.stderr, "Traceback" in refused.stderr) == (2, True, False)


def test_a_file_of_somebody_elses_is_a_sentence_and_nothing_starts(tmp_path):
    (tmp_path / "notes").write_text("mine\n" * 1000)
    config = tmp_path / "instrument.toml"
    config.write_text(f'[rig]\nport = "{tmp_path}/no"\n[events]\nfile = "notes"\n')
    refused = pneuforce("run", "--config", config)
    assert refused.returncode == 2
    assert "no event log" in refused.stderr.splitlines()[-1]


def test_what_is_added_is_followed(tmp_path):
    file = written(tmp_path / "log", range(2))
    words = [sys.executable, "-m", "instrument", "log", "show", "--file", str(file), "--json", "--follow"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=os.environ) as following:
        lines = [following.stdout.readline() for _ in range(2)]
        written(file, range(2, 4))
        lines += [following.stdout.readline() for _ in range(2)]
        following.send_signal(signal.SIGINT)
        assert following.wait(10) == 0
    assert [json.loads(line)["which"] for line in lines] == [0, 1, 2, 3]


def test_an_end_that_others_are_told_of_is_no_trip(tmp_path):
    """Page and recorder are waited for when the rig has been let go: its silence then is nobody's fault."""
    with ExitStack() as children:
        link, config = str(tmp_path / "rig"), tmp_path / "i.toml"
        children.enter_context(Child("simulator", ["instrument", "sim", "--link", link])).ready()
        tables = {"rig": {"port": link}, "modbus": {"port": free_port()}}
        config.write_text(toml({**tables, "page": {"enabled": True, "port": free_port()}}))
        words = ["instrument", "run", "--config", str(config), "--record", str(tmp_path / "a.tape")]
        host = children.enter_context(Child("instrument", words))
        host.ready()
        time.sleep(0.5)
        host.send(signal.SIGTERM)
        while host.running:
            time.sleep(0.01)
    life = records(tmp_path / "events.sqlite")
    assert life[-1]["kind"] == "stop"
    assert [record["is"] for record in life if record["kind"] == "state"][-1] == "vented"
    with opened(tmp_path / "a.tape") as recording:
        assert [*recording.events()][-1]["kind"] == "stop"
        assert recording.ending.how == How.END
