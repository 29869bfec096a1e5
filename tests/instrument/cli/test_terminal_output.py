"""Tests of strings from datetime import datetime
from files and from other programs: the commands print no control characters from them."""

import csv
import io
import json
import logging
import math
import os
import sqlite3
from contextlib import closing
from datetime import datetime
from pathlib import Path

import pytest

from pneuforce.instrument.audit.reading import open_event_log
from pneuforce.instrument.audit.store import EventLogFile
from pneuforce.instrument.cli.config_check import check_config
from pneuforce.instrument.cli.log.table import CSV_COLUMNS, EventSelection, show_events
from pneuforce.instrument.cli.log.verification import Verification, verify_events
from pneuforce.instrument.cli.rig import doctor
from pneuforce.instrument.cli.terminal.output import json_line, json_text
from pneuforce.instrument.doctor.check import Check, CheckResult
from pneuforce.instrument.doctor.port import port_checks
from tests.command_runner import pneuforce

TOP = Path(__file__).parents[3]
#: Sets the title of a terminal and clears it; then C1, DEL, a bidirectional override, and line separators.
EVIL = "x\x1b]0;owned\x07\x1b[2J\x9b31m\x7f\u202e\u2066\u2028\u2029\x85\r\b\ud800y"
RECORDS = [
    {"at": "2027-01-31T08:00:00Z", "kind": "write", "who": EVIL, "result": EVIL, "values": {EVIL: [1, EVIL]}},
    {"at": EVIL, "kind": EVIL, "was": EVIL, "is": [EVIL]},
    {"at": "2027", "kind": "stop", "why": EVIL},
    {"at": "2027", "kind": "repeated", "times": EVIL, "since": EVIL, "until": EVIL, "of": {"kind": EVIL}},
    {EVIL: EVIL},
    [EVIL],
]


@pytest.fixture
def evil_log(tmp_path):
    """Return a log with correct digests whose records contain control characters."""
    log = EventLogFile(tmp_path / "log")
    for fields in RECORDS:
        log.append([json.dumps(fields, ensure_ascii=False).encode(errors="replace")])
        log.append([json.dumps(fields).encode()])
    log.close()
    return tmp_path / "log"


def assert_printable(text):
    assert text
    assert all(line.isprintable() for line in text.split("\n")), ascii(text)


@pytest.mark.parametrize("as_json", [False, True])
def test_a_record_of_the_event_log_is_shown_without_control_characters(evil_log, capsys, as_json):
    show_events(evil_log, EventSelection(), as_json)
    output = capsys.readouterr().out
    assert_printable(output)
    assert "x\\" in output
    assert output.count("\n") >= 2 * len(RECORDS)


def test_the_csv_of_the_event_log_has_the_texts_of_the_table_in_one_line_for_each_record(evil_log, capsys):
    show_events(evil_log, EventSelection(), as_json=False, as_csv=True)
    output = capsys.readouterr().out
    assert_printable(output)
    rows = list(csv.DictReader(io.StringIO(output)))
    assert tuple(rows[0]) == CSV_COLUMNS
    assert [row["number"] for row in rows] == [str(number + 1) for number in range(2 * len(RECORDS))]
    assert {len(row["digest"]) for row in rows} == {64}


def test_the_csv_names_a_reject_reason_and_follows_a_log_with_one_header(tmp_path, capsys, monkeypatch):
    fields = {"at": "2027-01-31T08:00:00.123456Z", "kind": "write", "who": "web anna@192.168.1.20"}
    body = json.dumps({**fields, "result": "state", "values": {"mode": ["vent", "hold"]}}).encode()
    log = EventLogFile(tmp_path / "log")
    log.append([body])
    rounds = iter((lambda: log.append([body]), lambda: None))

    def sleep(_seconds):
        step = next(rounds, None)
        if step is None:
            raise KeyboardInterrupt
        step()

    monkeypatch.setattr("pneuforce.instrument.cli.log.table.time.sleep", sleep)
    show_events(tmp_path / "log", EventSelection(follow=True), as_json=False, as_csv=True)
    log.close()
    header, *rows = list(csv.reader(io.StringIO(capsys.readouterr().out)))
    assert header == list(CSV_COLUMNS)
    assert [row[:6] for row in rows] == [
        [str(number), *fields_of_row] for number, fields_of_row in ((1, ROW), (2, ROW))
    ]


#: Cells of the record in the test above, without its number and its digest.
ROW = ["2027-01-31T08:00:00.123456Z", "web anna@192.168.1.20", "write", "rejected: state", "mode vent → hold"]


def test_only_one_output_format_can_be_chosen(evil_log):
    done = pneuforce("log", "show", "--file", evil_log, "--csv", "--json")
    assert (done.returncode, "give only one of them" in done.stderr + done.stdout) == (2, True)


def test_a_table_without_records_says_so(tmp_path, capsys):
    (tmp_path / "empty").touch()
    show_events(tmp_path / "empty", EventSelection(), as_json=False)
    assert "empty contains no record\n" in capsys.readouterr().err
    show_events(tmp_path / "empty", EventSelection(since=datetime(2100, 1, 1)), as_json=True)
    assert "contains no record since 2100-01-01 00:00:00 UTC" in capsys.readouterr().err


def test_on_a_narrow_terminal_each_record_is_readable(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("pneuforce.instrument.cli.log.table.PIPED_WIDTH", 80)
    log = EventLogFile(tmp_path / "log")
    record = {"at": "2027-01-31T08:00:00.123456Z", "kind": "write", "who": "modbus_tcp 192.168.100.200"}
    log.append([json.dumps({**record, "result": "fault_latched", "values": {"mode": "hold"}}).encode()] * 2)
    log.close()
    show_events(tmp_path / "log", EventSelection(), as_json=False)
    headings, *lines = capsys.readouterr().out.splitlines()
    assert "result" in headings
    assert max(map(len, lines)) <= 80
    for text in ("2027-01-31 08:00:00 ", "rejected: fault_latched", "write: values"):
        assert sum(text in line for line in lines) == 2


def test_the_json_of_a_record_means_the_same_as_the_record(evil_log, capsys):
    show_events(evil_log, EventSelection(), as_json=True)
    shown = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [{name: fields[name] for name in RECORDS[0]} for fields in shown[1:2]] == RECORDS[:1]


@pytest.mark.parametrize("as_json", [False, True])
def test_the_verification_prints_no_control_characters(evil_log, capsys, as_json):
    assert verify_events(evil_log, Verification(), as_json) == 0
    assert_printable(capsys.readouterr().out)


@pytest.mark.parametrize("as_json", [False, True])
@pytest.mark.parametrize("number", ["'x\x1b[2J'", "x'1b5b324a'", "1.5", "NULL"])
def test_a_record_whose_number_is_no_integer_is_shown(tmp_path, capsys, as_json, number):
    file = tmp_path / "log"
    EventLogFile(file).close()
    with closing(sqlite3.connect(file)) as db:
        db.execute("DROP TABLE records")
        db.execute("CREATE TABLE records (number, body, digest)")
        db.execute(f"INSERT INTO records VALUES ({number}, '{{}}', 'x\x1b[2J')")
        db.commit()
    show_events(file, EventSelection(), as_json)
    with open_event_log(file) as rows:
        count = len(list(rows))
    shown = capsys.readouterr().out
    assert not count or shown.strip()
    assert all(line.isprintable() for line in shown.split("\n"))


def test_a_nested_record_is_shown(tmp_path, capsys):
    """Each level of a counted event is described by a recursive call."""
    log = EventLogFile(tmp_path / "log")
    for depth in (3, 100, 300, 900):
        body = '{"kind":"held_back","times":1,"since":"a","until":"b","of":' * depth + "{}" + "}" * depth
        log.append([body.encode()])
    log.close()
    for as_json in (False, True):
        show_events(tmp_path / "log", EventSelection(), as_json)
        assert_printable(capsys.readouterr().out)


def test_the_doctor_prints_no_control_characters(capsys):
    doctor.print_checks([Check("sensor", CheckResult.FAIL, EVIL, f"[bold]{EVIL}")])
    assert_printable(capsys.readouterr().out)


def test_the_doctor_shows_the_name_of_another_process_without_control_characters(capsys):
    """Every user can give a process a name with control characters."""
    master, port = os.openpty()
    is_closed, closed = os.pipe()
    try:
        name = os.ttyname(port)
        with open("/proc/self/comm", "r+") as comm:
            before = comm.read()
            comm.write("x\x1b[2J")
        child = os.fork()
        if child == 0:
            os.close(master)  # the doctor ignores processes with both ends of the pseudo-terminal
            os.write(closed, b"\n")
            os.read(port, 1)
            os._exit(0)
        os.read(is_closed, 1)
        with open("/proc/self/comm", "w") as comm:
            comm.write(before.strip())
        checks = port_checks(name)
        os.write(master, b"\n")
        os.waitpid(child, 0)
    finally:
        for descriptor in (master, port, is_closed, closed):
            os.close(descriptor)
    doctor.print_checks(checks)
    shown = capsys.readouterr().out
    assert_printable(shown)
    assert f"x\x1b[2J ({child})" in checks[3].finding
    assert "x\\x1b[2J" in shown


@pytest.mark.parametrize("as_json", [False, True])
def test_the_check_of_a_configuration_prints_no_control_characters(tmp_path, as_json):
    file = tmp_path / "evil\x1b[2J.toml"
    file.write_text('[modbus]\n"key\\u001b[2J\\u202e" = 1\nhost = "\\u001b[2J\\n\\u009b"\n')
    done = pneuforce("config", "--check", file, *(["--json"] if as_json else []))
    assert done.returncode == 78
    assert_printable((done.stdout if as_json else done.stderr).rstrip("\n"))


def test_a_valid_configuration_with_control_characters_in_its_name(tmp_path, capsys):
    file = tmp_path / "evil\x1b[2J.toml"
    file.write_text('[rig]\nport = "/dev/x"\n')
    for as_json in (False, True):
        check_config([file], as_json)
        assert_printable(capsys.readouterr().out)


def test_an_error_message_contains_no_control_characters(tmp_path):
    for words in (
        ["log", "show", "--file", tmp_path / "evil\x1b[2J\u202e"],
        ["log", "verify", "--file", tmp_path / "evil\x1b[2J\u202e"],
        ["replay", tmp_path / "evil\x9b.recording"],
        ["calibrate", "radius", tmp_path / "evil\x1b.csv"],
    ):
        done = pneuforce(*words)
        assert done.returncode == 2
        assert_printable(done.stderr)


def test_a_column_name_of_a_calibration_file_is_shown_without_control_characters(tmp_path):
    data = tmp_path / "radius.csv"
    data.write_text("pressure_kpa,evil\x1b[2J\u202e\n1,2\n")
    done = pneuforce("calibrate", "radius", data)
    assert done.returncode == 2
    assert_printable(done.stderr)


@pytest.mark.parametrize("json_option", [[], ["--json"]])
def test_the_result_of_a_calibration_prints_no_control_characters(tmp_path, json_option):
    out = tmp_path / "evil\x1b[2J.toml"
    done = pneuforce("calibrate", "radius", TOP / "docs/examples/radius.csv", "--out", out, *json_option)
    assert done.returncode == 0, done.stderr
    assert_printable(done.stdout)
    assert out.exists()


def test_json_has_null_for_each_value_that_is_not_available():
    values = {"force_n": math.nan, "list": [1.5, math.inf], "nested": {"age_s": -math.inf}, "name": "a"}
    expected = {"force_n": None, "list": [1.5, None], "nested": {"age_s": None}, "name": "a"}
    assert json.loads(json_text(values)) == json.loads(json_line(values)) == expected


def test_the_doctor_restores_the_level_of_the_log(capsys):
    level = logging.getLogger("pneuforce").level
    assert doctor.run_doctor("/dev/missing", None, as_json=True) == 1
    assert logging.getLogger("pneuforce").level == level
    assert "/dev/missing" in capsys.readouterr().out
