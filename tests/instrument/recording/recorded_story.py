"""Recording of an instrument in virtual time, and the story of four contacts and a trip."""

from pneuforce.instrument.recording.writer import RecordingWriter
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, json_entry
from pneuforce.instrument.stream.sample_record import pack
from tests.instrument.instrument_harness import HOLD_8, VENT, InstrumentHarness

OVERPRESSURE = 4
PUSHES_KPA = (1.0, 0.0, 2.0, 0.3, 1.5, 0.0, 0.2, 0.0)


def record_story(path, story):
    """Record an instrument with a zeroed sensor while the function `story` operates the instrument."""
    harness, file = InstrumentHarness.zeroed(), RecordingWriter(path)
    file.add_entry(json_entry(EntryKind.HEADER, harness.now_s, {"version": "0.1.0", "simulated": True}))
    process = harness.instrument.process

    def process_and_record(raw):
        m = process(raw)
        file.add_entry(StreamEntry(EntryKind.SAMPLE, raw.t_s, pack(raw, m)))
        return m

    harness.instrument.process = process_and_record
    story(harness, file)
    file.commit()
    file.close()
    return path


def hold(harness, _=None):
    harness.write_ok(VENT)
    harness.write_ok(HOLD_8)
    harness.renew(2.0)


def press(harness, _=None):
    hold(harness)
    for push_kpa in PUSHES_KPA:
        harness.push_kpa = push_kpa
        harness.renew(0.7)
    harness.causes.add(OVERPRESSURE)
    harness.run(1.0)
