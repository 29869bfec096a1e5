"""Tests of docs/reference/security.md: its evidence exists, and its tables are complete."""

import re

from tests.source_tree import ROOT

PAGE = (ROOT / "docs/reference/security.md").read_text(encoding="utf-8")
#: Component requirements of IEC 62443-4-2:2019 for SL-C 1, without those for network devices.
SL_1 = {
    *(f"CR 1.{number}" for number in (1, 3, 4, 5, 7, 10, 11, 12)),
    *(f"CR 2.{number}" for number in (1, 2, 5, 8, 9, 10, 11, 12)),
    *(f"CR 3.{number}" for number in (1, 3, 4, 5, 6, 7)),
    *("CR 4.1", "CR 4.3", "CR 5.1", "CR 6.1"),
    *(f"CR 7.{number}" for number in (1, 2, 3, 4, 6, 7)),
    *("EDR 2.4", "EDR 3.2", "EDR 3.10", "EDR 3.14", "SAR 2.4", "SAR 3.2"),
}
RESULTS = {"met", "by configuration", "not met", "not applicable"}
ROWS = re.findall(r"^\| ((?:CCSC|CR|EDR|SAR|NDR) [^|]*) \| ([^|]*) \| ([^|]*) \|$", PAGE, re.MULTILINE)


def test_each_requirement_of_sl_1_has_a_result_and_a_reason():
    named = [name for title, _, _ in ROWS for name in re.findall(r"(?:CR|EDR|SAR) \d+\.\d+", title)]
    assert set(named) >= SL_1
    assert len(named) == len(set(named))
    assert {result for _, result, _ in ROWS} == RESULTS
    assert all(len(reason) > 10 for *_, reason in ROWS)


def test_each_threat_names_evidence_that_exists():
    (table,) = re.findall(r"^\| threat .*\n\|.*\n((?:\|.*\n)+)", PAGE, re.MULTILINE)
    evidence = [row.split("|")[3] for row in table.splitlines()]
    assert len(evidence) >= 10
    for cell in evidence:
        links = re.findall(r"\]\(([^)#]+)", cell)
        assert links, cell
        assert all((ROOT / "docs/reference" / link).exists() for link in links), cell
    for name, target in re.findall(r"\[`([^`]+\.py)`\]\(([^)]+)\)", PAGE):
        assert target.endswith(f"/{name}")
