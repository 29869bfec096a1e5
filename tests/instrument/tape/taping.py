"""Recordings made by hand, and all that a reader finds in one."""

import math
from typing import NamedTuple

from instrument.measurement import Measurement
from instrument.rig.frames import BoardState, Sample, Valve
from instrument.rig.link import RawSample
from instrument.tape.entry import INPUTS, Entry, Kind, told
from instrument.tape.file import TapeFile
from instrument.tape.measured import pack, unpack
from instrument.tape.opening import opened
from instrument.tape.schema import How

BEGIN_S = 1000.5
DT_S = 0.002
ABOUT = {"version": "0.1.0", "configuration": {"rig": {"port": "/dev/ttyΔ"}}, "calibration": None}


def sample_body(number):
    """A sample in free air each fifth time, else one of a contact."""
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


def entries(count, first=1):
    """Inputs, and what came of them."""
    for number in range(first, first + count):
        t_s = BEGIN_S + number * DT_S
        yield Entry(Kind.RECEIVED, t_s, bytes([number % 256]) * 24)
        if number % 5 == 0:
            yield Entry(Kind.BEAT, t_s, b"\0")
        if number % 100 == 0:
            yield told(
                Kind.EVENT,
                t_s,
                {"at": f"2027-01-31T08:00:{number % 60:02}Z", "kind": "test", "which": number},
            )
        yield Entry(Kind.MEASURED, t_s, sample_body(number))


def begun(path):
    file = TapeFile(path)
    file.put(told(Kind.BEGIN, BEGIN_S, ABOUT))
    file.put(Entry(Kind.CHECKPOINT, BEGIN_S, b"state" * 999))
    file.commit()
    return file


def put(file, tape, per_commit=100):
    """Put entries down, committed as a recorder does it."""
    for number, entry in enumerate(tape, 1):
        file.put(entry)
        if number % per_commit == 0:
            file.commit()
    file.commit()


def ended(path, count):
    """A recording in good order."""
    file = begun(path)
    put(file, entries(count))
    file.end(How.STOPPED, "")
    file.commit()
    file.close()
    return path


class Found(NamedTuple):
    """All that can be read of a recording, and what is wrong with it."""

    about: dict
    checkpoint: Entry | None
    inputs: list
    samples: list
    events: list
    ending: tuple | None
    remark: str


def found(path):
    with opened(path) as recording:
        parts = (
            recording.about,
            recording.checkpoint,
            *map(list, (recording.entries(), recording.samples(), recording.events())),
        )
        return Found(*parts, recording.ending, recording.remark())


class Wanted(NamedTuple):
    inputs: list
    samples: list
    events: list


def wanted(count):
    """What a reader of so many samples is to find."""
    tape = list(entries(count))
    return Wanted(
        [entry for entry in tape if entry.kind in INPUTS],
        [unpack(entry.body) for entry in tape if entry.kind is Kind.MEASURED],
        [entry.facts for entry in tape if entry.kind is Kind.EVENT],
    )


def same(samples):
    """Samples as what can be compared: NaN is not equal to itself."""
    return [tuple(None if value != value else value for value in sample) for sample in samples]
