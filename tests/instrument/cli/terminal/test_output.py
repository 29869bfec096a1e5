"""Tests of the output of long texts."""

import re
import sys

from pneuforce.instrument.cli.terminal.output import hanging


def test_a_long_text_has_a_hanging_indent_only_on_a_terminal(monkeypatch):
    text = f"The vent valve is stuck. Look at {'x' * 80} and vent again, then clear the fault of the valve."
    monkeypatch.setenv("COLUMNS", "80")
    assert hanging(text, 11) == text
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    first, *lines = hanging(text, 11).splitlines()
    assert not first.startswith(" ")
    assert all(re.match(r" {11}\S", line) for line in lines)
    assert [line for line in lines if len(line) > 80] == [f"{' ' * 11}{'x' * 80}"]
    assert " ".join(f"{first} {' '.join(lines)}".split()) == text
