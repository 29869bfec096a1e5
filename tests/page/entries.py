"""Entries of the tape as an instrument would give them to the page."""

import json

from instrument.measurement import Measurement
from instrument.rig.frames import Sample
from instrument.rig.link import RawSample
from instrument.tape.entry import Entry, Kind, told
from instrument.tape.measured import pack
from registers.source import Peer
from tests.instrument.driving import Drive

HELD = Sample(0, 8000, 5000, 0, 4, 0, 0, 0, 8000)
STATE = {"state": "holding", "status": ["holding"], "faults": [], "force_n": 0.5}


def begin(t_s=0.0, **facts):
    return told(Kind.BEGIN, t_s, {"version": "1.2", "serial_number": 7, "simulated": True, **facts})


def measured(t_s, **measurement):
    measurement = {"pressure_kpa": 8.0, "initial_kpa": 8.0, "rise_kpa": 0.0, **measurement}
    return Entry(Kind.MEASURED, t_s, pack(RawSample(0, t_s, HELD), Measurement(t_s=t_s, **measurement)))


def snapshot(t_s, **changes):
    return told(Kind.SNAPSHOT, t_s, {**STATE, **changes})


def event(at, **facts):
    return told(Kind.EVENT, 0.0, {"at": at, **facts})


def health(t_s, **parts):
    return told(Kind.HEALTH, t_s, {"rig": {"samples": 0}, "modbus_tcp": None, "can": None, **parts})


def real_snapshot():
    """That of an instrument that holds 8 kPa, and what is put on the tape of it."""
    drive = Drive.holding()
    shown = drive.instrument.snapshot(Peer("page"), drive.now_s)
    plain = {name: sorted(v) if isinstance(v, frozenset) else v for name, v in shown._asdict().items()}
    return shown, json.loads(json.dumps(plain).replace("NaN", "null"))
