"""Tests of `pneuforce validate` with an exported recording and a reference force."""

import json

import pytest

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.rig.link import RawSample
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry
from pneuforce.instrument.stream.sample_record import pack
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.protocol.frames import BoardState, Sample, Valve
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import load
from tests.command_runner import pneuforce
from tests.instrument.recording.recording_files import BEGIN_S, begin_recording

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
SAMPLES_PER_READING = 5  #: 500 samples and 100 readings of the reference per second


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with the recording of a simulated scenario, and the true force as a sensor logs it."""
    folder = tmp_path_factory.mktemp("simulated")
    (folder / "scenario.toml").write_text(SCENARIO)
    file = begin_recording(folder / "a.recording")
    truths = ["t_s,force_n\n"]
    playback = Playback(load(str(folder / "scenario.toml")))
    for number, (measurement, truth) in enumerate(measure_playback(playback, ChainSettings())):
        recorded = measurement._replace(t_s=BEGIN_S + measurement.t_s)
        file.add_entry(
            StreamEntry(
                EntryKind.SAMPLE, recorded.t_s, pack(RawSample(number % 2**16, 0.0, MESSAGE), recorded)
            )
        )
        if number % SAMPLES_PER_READING == 0:
            truths.append(f"{truth.t_s:.6f},{truth.force_n:.5f}\n")
    file.end(EndReason.STOPPED, "")
    file.commit()
    file.close()
    (folder / "cell.csv").write_text("".join(truths))
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
