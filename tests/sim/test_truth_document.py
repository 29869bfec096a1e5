"""Test that docs/simulator.md describes each column of `pneuforce sim truth`."""

import re
from pathlib import Path

from pneuforce.sim.rig import Truth

DOCUMENT = (Path(__file__).parents[2] / "docs/simulator.md").read_text(encoding="utf-8")


def test_the_document_names_each_column_of_the_true_values_in_their_order():
    table = DOCUMENT.partition("- **True values.**")[2].partition("\n\nThese scenarios")[0]
    rows = re.findall(r"^  \| (`[^|]+) \|", table, re.MULTILINE)
    names = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert names == ["utc_s", *Truth._fields, "setpoint_kpa"]
