"""A recording and a reference force become what `pneuforce validate` reads."""

import json

import pytest

from instrument.chain import ChainSettings
from instrument.cli.measured_scenario import measured
from instrument.rig.frames import BoardState, Sample, Valve
from instrument.rig.link import RawSample
from instrument.tape.entry import Entry, Kind
from instrument.tape.measured import pack
from instrument.tape.schema import How
from sim.headless import Playback
from sim.scenario import load
from tests.instrument.tape.taping import BEGIN_S, begun
from tests.typed import pneuforce

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
MESSAGE = Sample(0, 3000, 5000, Valve(0), BoardState.HOLDING, 0, 0, 1, 8000)
REFERENCE_EACH = 5  #: samples, so 100 a second


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A recording of a played scenario, and the true force as a load cell logs it."""
    folder = tmp_path_factory.mktemp("played")
    (folder / "scenario.toml").write_text(SCENARIO)
    file = begun(folder / "a.tape")
    truths = ["t_s,force_n\n"]
    playback = Playback(load(str(folder / "scenario.toml")))
    for number, (measurement, truth) in enumerate(measured(playback, ChainSettings())):
        recorded = measurement._replace(t_s=BEGIN_S + measurement.t_s)
        file.put(Entry(Kind.MEASURED, recorded.t_s, pack(RawSample(number % 2**16, 0.0, MESSAGE), recorded)))
        if number % REFERENCE_EACH == 0:
            truths.append(f"{truth.t_s:.6f},{truth.force_n:.5f}\n")
    file.end(How.STOPPED, "")
    file.commit()
    file.close()
    (folder / "cell.csv").write_text("".join(truths))
    return folder


def validated(*words):
    done = pneuforce("validate", *words, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_what_is_exported_with_its_reference_is_validated_as_the_scenario_itself(folder):
    words = ("--format", "validation", "--reference", folder / "cell.csv")
    done = pneuforce("export", folder / "a.tape", folder / "trials.csv", *words)
    assert done.returncode == 0, done.stderr
    answer = validated("--data", folder / "trials.csv")
    played = validated("--scenario", folder / "scenario.toml")
    assert answer["contacts"] == played["contacts"]
    assert answer["contacts"]["evaluated"] == 3
    for ours, theirs in zip(answer["peak_errors_percent"], played["peak_errors_percent"], strict=True):
        for method in ("energetic", "lulevich", "shanahan"):
            # the reference was read 100 times a second, the truth 500 times
            assert ours[method]["absolute"] == pytest.approx(theirs[method]["absolute"], abs=0.3), ours[
                "group"
            ]
