"""Test of the form of all results with --json: one line with the common keys, or a documented stream."""

import json
import re
import subprocess
import sys

import pytest
import typer.main

from pneuforce.instrument.cli.app import app
from pneuforce.teststand.child_process import ChildProcess
from tests.command_runner import pneuforce
from tests.instrument.cli.terminal.test_failure import KEYS
from tests.instrument.recording.recorded_scenario import record_scenario
from tests.source_tree import ROOT

EXAMPLES = ROOT / "docs/examples"
PRESSURES = "--dpi 8 --dpf 9.2"
SCENARIO = """
doc = "Two contacts."
[plant]
kind = "published"
[[phase]]
setpoint_kpa = [8.0]
[[phase.contact]]
kind = "press"
force_n = [1.0, 2.0]
hold_s = 1.0
pause_s = 1.5
"""
#: Commands that prepare the files of the other commands.
PREPARATION = (
    "certificates authority pki",
    "certificates instrument pki --host 127.0.0.1",
    f"calibrate radius {EXAMPLES}/radius.csv --out calibration.toml",
)
#: Each command with options with which it succeeds. The order matters.
RUNS = (
    f"estimate {PRESSURES}",
    "estimate --dpi 1 --dpf 9.2",
    "estimate --csv pressures.csv",
    f"uncertainty {PRESSURES}",
    "uncertainty --csv pressures.csv",
    f"validate --data {EXAMPLES}/validation-recording.csv",
    f"calibrate radius {EXAMPLES}/radius.csv",
    f"calibrate volume {EXAMPLES}/volume.csv",
    f"calibrate lag {EXAMPLES}/lag.csv",
    "calibrate grip --mass-g 120 --before-kpa 8 --after-kpa 9.1 --out calibration.toml",
    f"calibrate force {EXAMPLES}/reference-contacts.csv",
    "calibrate contacts --from a.recording --reference cell.csv --offset 0",
    "config --check instrument.toml",
    "config --check instrument.toml --check other.toml",
    "certificates show pki/instrument.pem",
    "sign check instrument.toml",
    "users add anna --role operator --file users.toml",
    "users list --file users.toml",
    "users password anna --file users.toml",
    "users remove anna --file users.toml",
    "flash --port /dev/ttyACM9 --dry-run",
    "sim run --list",
    "sim fault --list",
    "doctor --port {rig}",
    "status --port {modbus}",
    "new-balloon 7 --port {modbus}",
    "zero --port {modbus}",
    "set 6 --port {modbus}",
    "limit 4.5 --port {modbus}",
    "watch modbus --seconds 0.5 --port {modbus}",
    "record live.recording --socket {socket} --seconds 1",
    "export live.recording live.csv",
    "plot live.recording live.svg",
    "evaluate live.recording --config instrument.toml",
    "replay live.recording",
    "sim hand off --control {control}",
    "sim press 0.1 --seconds 0 --control {control}",
    "press --release --control {control}",
    "sim truth --seconds 0.2 --control {control}",
    "sim fault --control {control}",
    "hold 2 --seconds 1.5 --port {modbus}",
    "release --port {modbus}",
    "vent --port {modbus}",
    "clear --port {modbus}",
    "log show --file {events}",
    "log verify --file {events}",
    "log copy copy.sqlite --file {events}",
)
#: Exit codes of the other commands.
CODES = {
    "estimate --dpi 1 --dpf 9.2": (1,),
    "sign check instrument.toml": (1,),  # no key has signed the file
    "doctor --port {rig}": (0, 1),  # a busy machine can fail a check of the time
}
#: A run with few contacts lasts minutes. tests/system/test_accuracy.py checks the result of a function call.
TESTED_ELSEWHERE = {"accuracy"}


def commands_with_json(group=None, name=""):
    """Yield the name of each command that has the option --json."""
    for word, command in (group or typer.main.get_command(app)).commands.items():
        path = f"{name} {word}".strip()
        if hasattr(command, "commands"):
            yield from commands_with_json(command, path)
        elif any("--json" in parameter.opts for parameter in command.params):
            yield path


COMMANDS = frozenset(commands_with_json())


def documented_streams():
    """Return the commands that print several objects according to the document."""
    page = (ROOT / "docs/how-to/command-line.md").read_text(encoding="utf-8")
    table = page.partition("| stream |")[2].partition("\n\n")[0]
    return set(re.findall(r"^\| `([a-z ]+)` \|", table, re.MULTILINE))


def command_of(words):
    """Return the name of the command in the words of a command line."""
    return max((name for name in COMMANDS if f"{words} ".startswith(f"{name} ")), key=len)


def deviation(words, done, codes=(0,)):
    """Return how the output of a command deviates from the rule, "" if it does not."""
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    code = done.returncode
    if code not in codes:
        return f"{words}: exit code {done.returncode}: {done.stdout}{done.stderr}"
    if not lines or not all(isinstance(line, dict) for line in lines):
        return f"{words}: not one object per line"
    result = lines[-1]
    if code == 0 and (name := command_of(words)) in documented_streams():
        if len(lines) < 2 and name != "watch":
            return f"{words}: a stream of one line"
        if name != "hold":
            return ""
    elif len(lines) != 1:
        return f"{words}: {len(lines)} lines"
    if list(result)[: len(KEYS)] != KEYS:
        return f"{words}: keys {list(result)[: len(KEYS)]}"
    if (result["ok"], result["exit_code"]) != (code == 0, code) or not result["message"]:
        return f"{words}: {result}"
    if result["ok"] and [result[key] for key in ("code", "reason", "remedy", "fault")] != [
        "done",
        *[None] * 3,
    ]:
        return f"{words}: a key of the command replaces a common key"
    return f"{words}: stderr {done.stderr}" if done.stderr else ""


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the files that the commands use."""
    folder = tmp_path
    record_scenario(folder, SCENARIO)
    (folder / "pressures.csv").write_text("baseline_kpa,final_kpa\n8,9.2\n1,9\n")
    (folder / "instrument.toml").write_text("[rig]\n")
    port, names = "[modbus]\nport = 5021\n", ("events.file", "local.socket", "can.parameter_file")
    tables = [f'[{name.partition(".")[0]}]\n{name.partition(".")[2]} = "other-{name}"\n' for name in names]
    (folder / "other.toml").write_text(port + '[rig]\nport = "/dev/ttyACM1"\n' + "".join(tables))
    for words in PREPARATION:
        assert pneuforce(*words.split(), cwd=folder).returncode == 0, words
    return folder


def test_each_command_with_json_prints_one_line_with_the_common_keys_or_is_a_documented_stream(
    shared_stack, folder
):
    assert len(COMMANDS) > 40
    assert {command_of(words) for words in RUNS} == COMMANDS - TESTED_ELSEWHERE
    assert documented_streams() <= COMMANDS
    places = {
        "modbus": shared_stack.modbus_port,
        "control": shared_stack.control.getpeername()[1],
        "socket": shared_stack.link.with_name("pneuforce.sock"),
        "events": shared_stack.link.with_name("events.sqlite"),
        "rig": folder / "rig",
    }
    found = []
    with ChildProcess(
        "simulator", ["pneuforce", "sim", "run", "--link", str(folder / "rig"), "--no-hand"]
    ) as rig:
        rig.ready()
        for words in RUNS:
            command = [sys.executable, "-m", "pneuforce", *words.format(**places).split(), "--json"]
            password = "correct horse battery" if words.startswith("users") else None
            done = subprocess.run(
                command, cwd=folder, input=password, capture_output=True, text=True, timeout=120, check=False
            )
            found.append(deviation(words, done, CODES.get(words, (0,))))
    assert "\n".join(filter(None, found)) == ""


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_each_command_with_json_reports_a_failure_with_the_common_keys(name):
    assert deviation(name, pneuforce(*name.split(), "--no-such-option", "--json"), (2,)) == ""
