"""Tests of checkpoints: a restored session has the same state and gives the same results."""

import dataclasses
import struct

import pytest

from pneuforce.instrument.config import load
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import NullSink, Session
from pneuforce.instrument.recording.checkpoint import restore_session, save_session
from pneuforce.instrument.stream.sample_record import pack
from pneuforce.registers.map_hash import MAP_HASH
from tests.command_runner import pneuforce
from tests.instrument.instrument_harness import HOLD_8, InstrumentHarness
from tests.instrument.recording.virtual_host import eventful
from tests.source_tree import ROOT


def pressed():
    harness = InstrumentHarness.holding()
    harness.push_kpa = 1.5
    harness.run(0.5)
    return harness


@pytest.mark.parametrize("make_harness", [InstrumentHarness.zeroed, InstrumentHarness.holding, pressed])
def test_a_restored_session_continues_bit_for_bit(make_harness):
    harness = make_harness()
    restored = restore_session(save_session(Session(harness.instrument)))
    for number in range(600):
        harness.push_kpa = 1.0 + 0.5 * (number % 300 > 150)
        harness.feed()
        raw = harness.instrument.raw
        restored.process(raw, harness.now_s)
        assert pack(raw, restored.instrument.measurement) == pack(raw, harness.instrument.measurement)
    assert snapshot_text(restored.instrument, harness) == snapshot_text(harness.instrument, harness)


def snapshot_text(instrument, harness):
    """Return a snapshot as text, because NaN does not equal NaN."""
    snapshot = instrument.snapshot(("modbus_tcp", "10.0.0.1"), harness.now_s)
    return repr(snapshot._replace(status=sorted(snapshot.status)))


def test_saving_changes_nothing_and_keeps_the_sink():
    sink = NullSink()
    session = Session(InstrumentHarness.holding().instrument, sink)
    state = save_session(session)
    assert save_session(session) == state
    assert session.sink is sink
    restored = restore_session(state)
    assert isinstance(restored.sink, NullSink)
    assert restored.sink is not sink
    assert vars(restored).keys() == vars(session).keys()
    assert save_session(restored) == state


def test_an_instrument_with_each_kind_of_calibration_can_be_restored(tmp_path):
    configuration, out = tmp_path / "instrument.toml", tmp_path / "calibration.toml"
    configuration.write_text('[measurement]\ncalibration = "calibration.toml"\n')
    for kind, points in {
        "force": "reference-contacts.csv",
        "lag": "lag.csv",
        "radius": "radius.csv",
        "volume": "volume.csv",
    }.items():
        done = pneuforce("calibrate", kind, ROOT / "docs/examples" / points, "--out", out)
        assert done.returncode == 0, done.stderr
        state = save_session(Session(Instrument(load(configuration).settings(MAP_HASH))))
        assert save_session(restore_session(state)) == state


def test_a_restored_session_keeps_a_latched_fault():
    harness = InstrumentHarness.holding()
    harness.latched.add(11)
    harness.feed()
    harness.run(0.1)
    restored = restore_session(save_session(Session(harness.instrument))).instrument
    assert restored.tripped
    assert restored.write(("modbus_tcp", "10.0.0.1"), HOLD_8, harness.now_s) == "fault_latched"


def parts_of(value):
    """Yield the declared state of an object, or the elements of a container, each with a name."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.metadata.get("state", True):
                yield field.name, getattr(value, field.name)
    elif isinstance(value, dict):
        yield from enumerate(part for pair in value.items() for part in pair)
    elif isinstance(value, list | tuple | set):
        yield from enumerate(sorted(value) if isinstance(value, set) else value)


def state_of(value, path="session"):
    """Return each plain value in the state of an object, with its path."""
    parts = [leaf for name, part in parts_of(value) for leaf in state_of(part, f"{path}.{name}")]
    if isinstance(value, float):
        value = struct.pack("<d", value)  # distinguishes zeros, and makes NaN equal to NaN
    return parts or [(path, value)]


def objects_in(value, path="session"):
    """Yield each object and each container in the state of an object, with its path."""
    for name, part in parts_of(value):
        yield from objects_in(part, f"{path}.{name}")
    if dataclasses.is_dataclass(value) or isinstance(value, list | dict | set | bytearray):
        yield path, value


def test_each_value_is_restored_to_the_last_bit():
    session = eventful()[0].session
    state = state_of(session)
    assert len(state) > 400
    assert state_of(restore_session(save_session(session))) == state


def test_the_state_has_no_undeclared_attributes():
    for path, value in objects_in(eventful()[0].session):
        if hasattr(value, "__dict__"):
            assert vars(value).keys() == {field.name for field in dataclasses.fields(value)}, path


def test_two_parts_of_the_state_never_share_a_changing_object():
    """A checkpoint would restore a shared object as two objects."""
    paths = {}
    for path, value in objects_in(eventful()[0].session):
        is_frozen = dataclasses.is_dataclass(value) and value.__dataclass_params__.frozen
        assert is_frozen or paths.setdefault(id(value), path) == path


@pytest.mark.parametrize(
    "value", [0.1 + 0.2, -0.0, 5e-324, 1.7976931348623157e308, float("nan"), float("-inf")]
)
def test_each_kind_of_number_is_restored_to_the_last_bit(value):
    session = Session(InstrumentHarness.new().instrument)
    session.instrument.peak_force_n = value
    restored = restore_session(save_session(session)).instrument.peak_force_n
    assert struct.pack("<d", restored) == struct.pack("<d", value)
