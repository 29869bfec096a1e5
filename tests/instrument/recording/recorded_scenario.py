"""Recording of a simulated scenario, and the true force as a reference sensor logs it."""

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.rig.link import RawSample
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry
from pneuforce.instrument.stream.sample_record import pack
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.protocol.frames import BoardState, Sample, Valve
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import load
from tests.instrument.recording.recording_files import BEGIN_S, begin_recording

MESSAGE = Sample(0, 3000, 5000, Valve(0), BoardState.HOLDING, 0, 0, 1, 8000)
SAMPLES_PER_READING = 5  #: 500 samples and 100 readings of the reference per second


def record_scenario(folder, scenario):
    """Write `scenario.toml`, `a.recording` and `cell.csv`. Return the readings (time [s], force [N]).

    The recording contains the samples, but not the bytes of the rig.
    """
    (folder / "scenario.toml").write_text(scenario)
    file, readings = begin_recording(folder / "a.recording"), []
    playback = Playback(load(str(folder / "scenario.toml")))
    for number, (measurement, truth) in enumerate(measure_playback(playback, ChainSettings())):
        recorded = measurement._replace(t_s=BEGIN_S + measurement.t_s)
        body = pack(RawSample(number % 2**16, 0.0, MESSAGE), recorded)
        file.add_entry(StreamEntry(EntryKind.SAMPLE, recorded.t_s, body))
        if number % SAMPLES_PER_READING == 0:
            readings.append((truth.t_s, truth.force_n))
    file.end(EndReason.STOPPED, "")
    file.commit()
    file.close()
    lines = [f"{t_s:.6f},{force_n:.5f}\n" for t_s, force_n in readings]
    (folder / "cell.csv").write_text("".join(["t_s,force_n\n", *lines]))
    return readings
