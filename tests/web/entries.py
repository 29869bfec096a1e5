"""Stream entries as an instrument sends them to the web server."""

import json

from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.rig.link import RawSample
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, json_entry
from pneuforce.instrument.stream.sample_record import pack
from pneuforce.protocol.frames import Sample
from pneuforce.registers.source import Peer
from tests.instrument.instrument_harness import InstrumentHarness

HOLDING_SAMPLE = Sample(0, 8000, 5000, 0, 4, 0, 0, 0, 8000)
STATE = {"state": "holding", "status": ["holding"], "faults": [], "force_n": 0.5}


def header(t_s=0.0, **fields):
    return json_entry(
        EntryKind.HEADER, t_s, {"version": "1.2", "serial_number": 7, "simulated": True, **fields}
    )


def sample(t_s, **measurement):
    measurement = {"pressure_kpa": 8.0, "baseline_kpa": 8.0, "rise_kpa": 0.0, **measurement}
    body = pack(RawSample(0, t_s, HOLDING_SAMPLE), Measurement(t_s=t_s, **measurement))
    return StreamEntry(EntryKind.SAMPLE, t_s, body)


def snapshot(t_s, **changes):
    return json_entry(EntryKind.SNAPSHOT, t_s, {**STATE, **changes})


def event(at, **fields):
    return json_entry(EntryKind.EVENT, 0.0, {"at": at, **fields})


def health(t_s, **sections):
    return json_entry(
        EntryKind.HEALTH, t_s, {"rig": {"samples": 0}, "modbus_tcp": None, "can": None, **sections}
    )


def real_snapshot():
    """Return the snapshot of an instrument that holds 8 kPa, and the same snapshot as JSON values."""
    harness = InstrumentHarness.holding()
    real = harness.instrument.snapshot(Peer("web"), harness.now_s)
    plain = {name: sorted(v) if isinstance(v, frozenset) else v for name, v in real._asdict().items()}
    return real, json.loads(json.dumps(plain).replace("NaN", "null"))
