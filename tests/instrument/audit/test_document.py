"""Tests of docs/events.md: the documented script works, and the table names all kinds of records."""

import re
import subprocess
import sys
from pathlib import Path

from pneuforce.instrument.audit.changes import ObservedState
from tests.instrument.audit.event_log_files import make_log, verify_log

DOCUMENT = (Path(__file__).parents[3] / "docs/events.md").read_text(encoding="utf-8")
SCRIPT = re.search(r"```python\n(.*?)```", DOCUMENT, re.DOTALL)[1]


def run_documented_script(folder):
    return subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=folder, capture_output=True, text=True, check=False
    )


def test_the_documented_verification_prints_the_head(tmp_path):
    file = make_log(tmp_path / "events.sqlite", range(5))
    assert run_documented_script(tmp_path).stdout == f"5 {verify_log(file).head}\n"


def test_the_table_names_all_kinds_of_records():
    kinds = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (`.*?) \|", DOCUMENT, re.MULTILINE))))
    assert set(ObservedState._fields) <= kinds
    assert {"start", "stop", "write", "request", "login", "answer", "repeated", "held_back", "lost"} <= kinds
