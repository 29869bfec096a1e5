"""The section on contacts and scenarios, held against what there is."""

import re
from pathlib import Path

import pytest

from sim.contacts.kinds import KINDS
from sim.headless import Playback
from sim.scenario import library, load

DOCUMENT = (Path(__file__).parents[2] / "docs/simulator.md").read_text(encoding="utf-8")
SECTION = DOCUMENT.split("## Contacts and scenarios")[1].split("\n## ")[0]


def rows(header):
    """Cells of the table under a header."""
    lines = SECTION.split(header)[1].strip().splitlines()[1:]
    return [line.strip("| ").split(" | ") for line in lines[: [*lines, ""].index("")]]


def test_the_example_is_a_scenario_that_plays(tmp_path):
    path = tmp_path / "example.toml"
    path.write_text(re.search(r"```toml\n(.*?)```", SECTION, re.DOTALL)[1])
    scenario = load(str(path))
    assert [len(phase.contacts) for phase in scenario.phases] == [10, 10]
    first = scenario.phase[0].model_copy(update={"repeat": 1})
    playback = Playback(scenario.model_copy(update={"phase": [first]}))
    assert sum(len(sent) for sent in playback) > 0
    assert playback.finished


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_contact_is_told_with_its_keys(kind):
    [keys] = [keys for name, _, keys in rows("| kind | what it is | its keys |") if name == f"`{kind}`"]
    everyones = {"kind", "pause_s", "angle_deg"}
    assert set(re.findall(r"`(\w+)`", keys)) == KINDS[kind].model_fields.keys() - everyones


def test_the_library_is_told_as_it_tells_itself():
    assert {name.strip("`"): doc for name, doc in rows("| scenario | what happens |")} == library()
