"""Test that docs/rules.md and the advice name each cause of the status bit maintenance_required."""

import re

from pneuforce.instrument.core import status
from pneuforce.instrument.core.state import InstrumentState
from pneuforce.registers.advice import STATUS_ADVICE
from tests.source_tree import ROOT

#: Words in the documents for each cause: flags of the host process, and conditions of the status.
FLAGS = {
    "can_down": "CAN interface",
    "log_down": "event log",
    "recording_down": "recording",
    "certificate_expiring": "certificate",
}
CONDITIONS = {
    "no_barometer": "ambient pressure",
    "clock_off": "clock",
    "foreign_firmware": "firmware",
    "service_down": "",  # the flags of the host process
}
LEAK = "leak|pressure of the locked balloon falls"


def test_the_documents_name_each_cause_of_maintenance_required():
    assert set(InstrumentState.service_failures.fget.__code__.co_names) == set(FLAGS)
    assert set(status._maintenance_required.__code__.co_varnames) - {"state", "now_s"} == set(CONDITIONS)
    section = (ROOT / "docs/rules.md").read_text(encoding="utf-8").partition("## Maintenance required")[2]
    causes = re.findall(r"^- (.*)$", section.partition("\n## ")[0], re.MULTILINE)
    words = [*FLAGS.values(), *filter(None, CONDITIONS.values()), LEAK]
    assert all(any(re.search(each, cause, re.IGNORECASE) for cause in causes) for each in words)
    assert len(causes) == len(words)
    advice = STATUS_ADVICE["maintenance_required"].do
    assert [each for each in words if not re.search(each, advice)] == []
