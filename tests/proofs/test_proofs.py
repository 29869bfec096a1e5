"""The quick proofs of the firmware. `make prove` runs all proofs."""

import re

import pytest

from tests.proofs.catalogue import PROPERTIES
from tests.proofs.checker import AVR, FOLDER, INSTALL, check, checker
from tests.rules.explorer import NO_DEAD_END
from tests.rules.rules import RULES
from tests.source_tree import ROOT

NAMES = [prop.name for prop in PROPERTIES]
QUICK = [prop for prop in PROPERTIES if prop.quick]
installed = pytest.mark.skipif(checker() is None, reason=f"the model checker is missing: {INSTALL}")


def name_of(prop):
    return prop.name


@installed
@pytest.mark.parametrize("prop", QUICK, ids=name_of)
def test_a_quick_property_is_proved(prop):
    assert check(prop).verdict == "proved"
    assert not prop.avr or check(prop, AVR).verdict == "proved"


@installed
@pytest.mark.parametrize("prop", QUICK, ids=name_of)
def test_the_proof_finds_its_planted_error(prop):
    assert check(prop, planted=prop.planted).verdict == "violated"
    assert not prop.avr or check(prop, AVR, prop.planted).verdict == "violated"


def test_each_property_and_each_rule_is_in_the_table_of_the_safety_rules():
    functions = re.findall(r"^void (\w+)\(void\)$", (FOLDER / "properties.c").read_text(), re.MULTILINE)
    document = (ROOT / "docs/safety.md").read_text(encoding="utf-8")
    assert sorted(functions) == sorted(NAMES)
    rules = {rule.__name__ for rule in RULES} | {NO_DEAD_END}
    assert set(re.findall(r"`([a-z0-9]+(?:_[a-z0-9]+)+)`", document)) == set(NAMES) | rules
