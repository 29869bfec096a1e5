"""Tests of `pneuforce validate` with an exported recording and a reference force."""

import json

import pytest

from tests.command_runner import pneuforce
from tests.instrument.recording.recorded_scenario import record_scenario

SCENARIO = """
doc = "Three contacts at one pressure."

[plant]
kind = "published"

[[phase]]
setpoint_kpa = [8.0]

[[phase.contact]]
kind = "press"
force_n = [1.6, 2.3, 3.0]
hold_s = 0.3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulated")
    record_scenario(folder, SCENARIO)
    return folder


def validated(*words):
    done = pneuforce("validate", *words, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_an_exported_recording_gives_the_same_report_as_its_scenario(folder):
    words = ("--format", "validation", "--reference", folder / "cell.csv")
    done = pneuforce("export", folder / "a.recording", folder / "trials.csv", *words)
    assert done.returncode == 0, done.stderr
    exported = validated("--data", folder / "trials.csv")
    simulated = validated("--scenario", folder / "scenario.toml")
    assert exported["contacts"] == simulated["contacts"]
    assert exported["contacts"]["evaluated"] == 3
    pairs = zip(exported["peak_errors_percent"], simulated["peak_errors_percent"], strict=True)
    for from_export, from_scenario in pairs:
        for method in ("energetic", "lulevich", "shanahan"):
            # The errors differ slightly, because the reference has fewer readings than the true force.
            expected = pytest.approx(from_scenario[method]["absolute"], abs=0.3)
            assert from_export[method]["absolute"] == expected, from_export["group"]
