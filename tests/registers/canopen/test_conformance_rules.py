"""Tests of the table of conformance rules: its evidence exists, and its page is current."""

import re
from pathlib import Path

import pytest

from tests.registers.canopen.cases import DYNAMIC_CASES, STATIC_CASES
from tests.registers.canopen.conformance_page import PATH, render
from tests.registers.canopen.conformance_rules import AREAS

TESTS = Path(__file__).parents[2]
FOLDERS = ("registers/canopen", "registers/views", "system")
CASES = {name for name, *_ in STATIC_CASES + DYNAMIC_CASES}
RULES = [rule for area in AREAS for rule in area.rules]
SUPPORT = {"yes", "partly", "no"}


def exists(evidence):
    if "::" not in evidence:
        return evidence in CASES
    file, _, test = evidence.partition("::")
    paths = [TESTS / folder / f"{file}.py" for folder in FOLDERS]
    text = "".join(path.read_text(encoding="utf-8") for path in paths if path.exists())
    return re.search(rf"^def {test}\(", text, re.MULTILINE) is not None


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.text)
def test_a_rule_has_evidence_that_exists_or_a_reason_why_it_does_not_apply(rule):
    assert bool(rule.evidence) != bool(rule.reason)
    assert [name for name in rule.evidence if not exists(name)] == []


def test_each_rule_is_listed_once_and_each_support_is_known():
    assert len({rule.text for rule in RULES}) == len(RULES)
    assert {area.support for area in AREAS} == SUPPORT


def test_the_committed_page_is_current():
    assert PATH.read_text(encoding="utf-8") == render(), (
        "run: python -m tests.registers.canopen.conformance_page"
    )
