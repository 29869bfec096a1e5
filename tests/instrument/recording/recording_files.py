"""Helpers for tests of recordings: write a recording and read all its contents."""

import math
from typing import NamedTuple

from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.recording.writer import RecordingWriter
from pneuforce.instrument.rig.link import RawSample
from pneuforce.instrument.stream.entry import INPUTS, EntryKind, StreamEntry, json_entry
from pneuforce.instrument.stream.sample_record import pack, unpack
from pneuforce.protocol.frames import BoardState, Sample, Valve

BEGIN_S = 1000.5
DT_S = 0.002
HEADER = {
    "version": "0.1.0",
    "utc_us": 1_790_000_000_123_456,
    "configuration": {"rig": {"port": "/dev/ttyΔ"}},
    "calibration": None,
}


def sample_body(number):
    """Return the body of a SAMPLE entry. Every fifth sample has no force."""
    t_s = BEGIN_S + number * DT_S
    message = Sample(
        board_time_us=2000 * number % 2**32,
        adc_sum=3000 + number % 997,
        supply_mv=5000,
        valves=Valve(0),
        state=BoardState.HOLDING,
        fault=0,
        faults=0,
        command=1,
        setpoint_pa=8000,
    )
    raw = RawSample(number % 2**16, t_s, message)
    force_n = math.nan if number % 5 == 0 else number / 7
    return pack(
        raw, Measurement(t_s, 8.0 + number / 3, 8.25, 8.0, 0.5, 4.5, -0.0, force_n=force_n, in_contact=True)
    )


def make_entries(count, first=1):
    """Yield the entries of `count` samples: inputs, samples and some events."""
    for number in range(first, first + count):
        t_s = BEGIN_S + number * DT_S
        yield StreamEntry(EntryKind.RECEIVED, t_s, bytes([number % 256]) * 24)
        if number % 5 == 0:
            yield StreamEntry(EntryKind.TICK, t_s, b"\0")
        if number % 100 == 0:
            yield json_entry(
                EntryKind.EVENT,
                t_s,
                {"at": f"2027-01-31T08:00:{number % 60:02}Z", "kind": "test", "which": number},
            )
        yield StreamEntry(EntryKind.SAMPLE, t_s, sample_body(number))


def begin_recording(path):
    """Return a writer with a header and a checkpoint."""
    file = RecordingWriter(path)
    file.add_entry(json_entry(EntryKind.HEADER, BEGIN_S, HEADER))
    file.add_entry(StreamEntry(EntryKind.CHECKPOINT, BEGIN_S, b"state" * 999))
    file.commit()
    return file


def add_entries(file, entries, per_commit=100):
    """Add entries and commit them in groups, as the recorder does."""
    for number, entry in enumerate(entries, 1):
        file.add_entry(entry)
        if number % per_commit == 0:
            file.commit()
    file.commit()


def make_recording(path, count):
    """Write a recording with a normal end."""
    file = begin_recording(path)
    add_entries(file, make_entries(count))
    file.end(EndReason.STOPPED, "")
    file.commit()
    file.close()
    return path


class RecordingContents(NamedTuple):
    """Everything that can be read from a recording."""

    metadata: dict
    checkpoint: StreamEntry | None
    inputs: list
    samples: list
    events: list
    ending: tuple | None
    remark: str


def read_contents(path):
    with open_recording(path) as recording:
        parts = (
            recording.metadata,
            recording.checkpoint,
            *map(list, (recording.entries(), recording.samples(), recording.events())),
        )
        return RecordingContents(*parts, recording.ending, recording.remark())


class ExpectedContents(NamedTuple):
    """Expected contents of a recording that `make_recording` writes."""

    inputs: list
    samples: list
    events: list


def expected_contents(count):
    """Return the expected contents of a recording of `count` samples."""
    entries = list(make_entries(count))
    return ExpectedContents(
        [entry for entry in entries if entry.kind in INPUTS],
        [unpack(entry.body) for entry in entries if entry.kind is EntryKind.SAMPLE],
        [entry.json_body for entry in entries if entry.kind is EntryKind.EVENT],
    )


def comparable(samples):
    """Return samples as tuples with None for NaN, because NaN does not equal NaN."""
    return [tuple(None if value != value else value for value in sample) for sample in samples]
