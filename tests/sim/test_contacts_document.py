"""Tests that the section on contacts and scenarios in docs/simulator.md agrees with the code."""

import re
from pathlib import Path

import pytest

from pneuforce.sim.contacts.kinds import CONTACT_TABLES
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import library, load

DOCUMENT = (Path(__file__).parents[2] / "docs/simulator.md").read_text(encoding="utf-8")
SECTION = DOCUMENT.split("## Contacts and scenarios")[1].split("\n## ")[0]


def rows(header):
    """Return the cells of the table with this header."""
    lines = SECTION.split(header)[1].strip().splitlines()[1:]
    return [line.strip("| ").split(" | ") for line in lines[: [*lines, ""].index("")]]


def test_the_example_is_a_valid_scenario(tmp_path):
    path = tmp_path / "example.toml"
    path.write_text(re.search(r"```toml\n(.*?)```", SECTION, re.DOTALL)[1])
    scenario = load(str(path))
    assert [len(phase.contacts) for phase in scenario.phases] == [10, 10]
    first = scenario.phase[0].model_copy(update={"repeat": 1})
    playback = Playback(scenario.model_copy(update={"phase": [first]}))
    assert sum(len(sent) for sent in playback) > 0
    assert playback.finished


@pytest.mark.parametrize("kind", CONTACT_TABLES)
def test_every_kind_of_contact_is_documented_with_its_keys(kind):
    [keys] = [keys for name, _, keys in rows("| kind | what it is | its keys |") if name == f"`{kind}`"]
    common = {"kind", "pause_s", "angle_deg"}
    assert set(re.findall(r"`(\w+)`", keys)) == CONTACT_TABLES[kind].model_fields.keys() - common


def test_every_scenario_of_the_library_is_documented_with_its_description():
    assert {name.strip("`"): doc for name, doc in rows("| scenario | what happens |")} == library()
