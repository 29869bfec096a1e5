"""Test that docs/rules.md and the register name each cause of the status bit maintenance_required."""

import re

from pneuforce.instrument.core import maintenance
from pneuforce.registers.codes import MAINTENANCE_CAUSES
from tests.source_tree import ROOT


def test_the_documents_and_the_register_name_each_cause_of_maintenance_required():
    causes = [bit.name for bit in MAINTENANCE_CAUSES.bits]
    assert list(maintenance._CONDITIONS) == causes
    section = (ROOT / "docs/rules.md").read_text(encoding="utf-8").partition("## Maintenance required")[2]
    listed = re.findall(r"^- `(\w+)`: ", section.partition("\n## ")[0], re.MULTILINE)
    assert listed == causes
