"""docs/events.md: its own check of a log works, and its table names the kinds that there are."""

import re
import subprocess
import sys
from pathlib import Path

from instrument.events.changes import Seen
from tests.instrument.events.keeping import chain_of, written

PAGE = (Path(__file__).parents[3] / "docs/events.md").read_text(encoding="utf-8")
BY_HAND = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)[1]


def checked_by_hand(folder):
    return subprocess.run(
        [sys.executable, "-c", BY_HAND], cwd=folder, capture_output=True, text=True, check=False
    )


def test_the_check_that_needs_nothing_of_ours_agrees(tmp_path):
    file = written(tmp_path / "events.sqlite", range(5))
    assert checked_by_hand(tmp_path).stdout == f"5 {chain_of(file).head}\n"


def test_what_the_witness_looks_at_is_in_the_table():
    kinds = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (`.*?) \|", PAGE, re.MULTILINE))))
    assert set(Seen._fields) <= kinds
    assert {"start", "stop", "write", "request", "answer", "repeated", "held_back", "lost"} <= kinds
