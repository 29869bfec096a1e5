"""Tests of the form of failures with --json: one JSON object with the same keys, for each command."""

import json
import math
import os
import re
import subprocess
import sys

import pytest

from pneuforce.client.rejection import rejected
from pneuforce.errors import ConfigurationError, Tripped, VentNotConfirmed
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.instrument.cli.terminal.failure import failure_text, failure_values
from pneuforce.instrument.cli.terminal.output import print_done
from tests.command_runner import pneuforce
from tests.source_tree import ROOT

KEYS = ["ok", "code", "exit_code", "message", "reason", "remedy", "fault"]


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("status --port 1", ExitCode.UNAVAILABLE),
        ("vent --port 1", ExitCode.UNAVAILABLE),
        ("set 6 --port 1", ExitCode.UNAVAILABLE),
        ("hold 6 --port 1", ExitCode.UNAVAILABLE),
        ("release --port 1", ExitCode.UNAVAILABLE),
        ("clear --port 1", ExitCode.UNAVAILABLE),
        ("zero --port 1", ExitCode.UNAVAILABLE),
        ("new-balloon 7 --port 1", ExitCode.UNAVAILABLE),
        ("new-balloon 65536", ExitCode.USAGE),
        ("press 1 --control 1", ExitCode.UNAVAILABLE),
        ("sim fault leak --control 1", ExitCode.UNAVAILABLE),
        ("sim truth --control 1", ExitCode.UNAVAILABLE),
        ("sim hand off --control 1", ExitCode.UNAVAILABLE),
        ("watch modbus --port 1", ExitCode.UNAVAILABLE),
        ("record a.recording --socket missing.sock", ExitCode.UNAVAILABLE),
        ("status --baud 9600", ExitCode.USAGE),
        ("set 1", ExitCode.USAGE),
        ("set", ExitCode.USAGE),
        ("vent --bogus", ExitCode.USAGE),
        ("bogus", ExitCode.USAGE),
        ("log verify --file missing.sqlite", ExitCode.USAGE),
        ("log copy a.sqlite --file missing.sqlite", ExitCode.USAGE),
        ("config --check missing.toml", ExitCode.CONFIGURATION),
        ("config --check .", ExitCode.CONFIGURATION),
    ],
)
def test_a_failure_is_one_json_object_with_the_sentence_of_the_command(tmp_path, words, code):
    done = pneuforce(*words.split(), "--json", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (code, "")
    (line,) = done.stdout.splitlines()
    result = json.loads(line)
    assert list(result) == KEYS
    assert (result["ok"], result["code"], result["exit_code"]) == (False, code.name.lower(), code)
    plain = pneuforce(*words.split(), cwd=tmp_path)
    assert (plain.returncode, plain.stdout, plain.stderr) == (code, "", f"pneuforce: {result['message']}\n")


def test_a_rejection_and_a_trip_name_their_reason_and_their_remedy():
    result = failure_values(rejected("hold", "lease_held"))
    assert (result["code"], result["reason"], result["fault"]) == ("rejected", "lease_held", None)
    assert result["remedy"]
    result = failure_values(Tripped("leak", "A cause.", "A remedy."))
    assert (result["code"], result["reason"], result["remedy"]) == ("hold_ended", "tripped", "A remedy.")
    assert result["fault"]["name"] == "leak"
    assert result["balloon_may_be_inflated"] is False
    result = failure_values(VentNotConfirmed("Not verified.", None, "vent_fault", "A remedy."))
    assert (result["code"], result["reason"]) == ("vent_not_confirmed", "tripped")
    assert result["balloon_may_be_inflated"] is True
    unknown = failure_values(Tripped("", "", "A remedy."))
    assert (unknown["reason"], unknown["fault"]) == ("tripped", None)


def test_the_notes_of_an_error_are_part_of_its_message():
    error = ConfigurationError("it failed")
    error.add_note("This helps")
    assert failure_text(error) == failure_values(error)["message"] == "it failed. This helps"


def test_the_document_lists_each_key():
    page = (ROOT / "docs/how-to/command-line.md").read_text(encoding="utf-8")
    table = page.partition("## JSON for programs\n")[2].partition("| key |")[2].partition("\n\n")[0]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == [*KEYS, "balloon_may_be_inflated"]


def test_a_full_output_has_the_code_of_the_failure_and_its_sentence():
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "pneuforce", "status", "--port", "1", "--json"]
        done = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=600, check=False
        )
    assert done.returncode == ExitCode.UNAVAILABLE
    assert done.stderr.startswith("pneuforce: tcp://127.0.0.1:1")


@pytest.mark.parametrize("words", [("vent", "--json"), ("clear",)])
def test_a_failure_has_its_code_even_if_the_output_is_closed(words):
    unread, stdout = os.pipe()
    os.close(unread)
    command = [sys.executable, "-m", "pneuforce", *words, "--port", "1"]
    done = subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=600, check=False)
    os.close(stdout)
    assert (done.returncode, "Traceback" in done.stderr) == (ExitCode.UNAVAILABLE, False), done.stderr


@pytest.mark.parametrize(
    ("words", "wrong", "help_command"),
    [
        ("hodl", "'hold'", "pneuforce -h"),
        ("set", "setpoint_kpa", "pneuforce set -h"),
        ("sim fault --jsn", "--jsn", "pneuforce sim fault -h"),
    ],
)
def test_wrong_words_are_reported_in_one_sentence_without_a_frame(words, wrong, help_command):
    done = pneuforce(*words.split())
    assert done.returncode == ExitCode.USAGE
    (line,) = done.stderr.splitlines()
    assert line.startswith("pneuforce: ")
    assert wrong in line.lower()
    assert line.endswith(f"(help: {help_command})")


@pytest.mark.parametrize(
    "words", ["set nan", "set -5", "set -5.5", "set 1e99", "set inf", "hold six", "hold -1"]
)
def test_an_invalid_setpoint_is_named_with_its_limits(words):
    done = pneuforce(*words.split())
    assert (done.returncode, done.stdout) == (ExitCode.USAGE, "")
    assert f"setpoint_kpa = {words.split()[1]} is invalid" in done.stderr
    assert "2 to 12" in done.stderr


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("set 13", "2 to 12 kPa ("),
        ("set 65", "2 to 12 kPa; 65 mbar are 6.5 kPa ("),
        ("hold 6500", "2 to 12 kPa; 6500 Pa are 6.5 kPa ("),
        ("set 200000", "2 to 12 kPa ("),
        ("hold 6 --lease 0", "0.2 to 60 s ("),
        ("hold 6 --seconds -1", "at least 0 s ("),
        ("vent --timeout 61", "0 to 60 s ("),
        ("doctor --port x --inflate 1", "2 to 12 kPa ("),
        ("status --port 0", "1 to 65535 ("),
        ("record x --max-mb 0", "at least 1 MB ("),
        ("plot x --from-s nan", "--from-s = nan is invalid: it must be at least 0 s ("),
        ("export x y.csv --to-s -1", "--to-s = -1 is invalid: it must be at least 0 s ("),
        ("set --seconds -1", "--seconds"),
    ],
)
def test_an_invalid_number_is_named_with_its_limits_and_unit(words, named):
    assert named in pneuforce(*words.split()).stderr


def test_a_result_has_the_keys_of_a_failure(capsys):
    print_done("The sentence.", True, force_n=math.nan)
    result = json.loads(capsys.readouterr().out)
    assert list(result) == [*KEYS, "force_n"]
    assert (result["ok"], result["code"], result["exit_code"]) == (True, "done", 0)


def test_the_help_shows_no_type_for_a_flag():
    shown = pneuforce("vent", "-h").stdout
    assert "--json" in shown
    assert "bool" not in shown
