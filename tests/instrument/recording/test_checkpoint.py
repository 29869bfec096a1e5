"""Tests of checkpoints: a restored session gives the same results; a manipulated pickle runs no code."""

import os
import pickle
import random
import sys

import pytest

from pneuforce.instrument.core.session import NullSink, Session
from pneuforce.instrument.recording.checkpoint import restore_session, save_session
from pneuforce.instrument.stream.entry import StreamError
from pneuforce.instrument.stream.sample_record import pack
from tests.instrument.instrument_harness import HOLD_8, InstrumentHarness


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


def test_a_restored_session_keeps_a_latched_fault():
    harness = InstrumentHarness.holding()
    harness.latched.add(11)
    harness.feed()
    harness.run(0.1)
    restored = restore_session(save_session(Session(harness.instrument))).instrument
    assert restored.tripped
    assert restored.write(("modbus_tcp", "10.0.0.1"), HOLD_8, harness.now_s) == "fault_latched"


class Call:
    """Object whose pickle calls a function when it is loaded."""

    def __init__(self, function, *arguments):
        self.function, self.arguments = function, arguments

    def __reduce__(self):
        return self.function, self.arguments


@pytest.mark.parametrize(
    "call",
    [
        Call(os.system, "touch /tmp/pneuforce-was-here"),
        Call(eval, "1/0"),
        Call(getattr, "x", "upper"),
        Call(__import__, "os"),
        Call(pickle.loads, b"N."),
    ],
)
def test_a_pickle_that_calls_another_function_is_rejected_before_the_call(call):
    with pytest.raises(StreamError, match="not allowed"):
        restore_session(pickle.dumps({"instrument": call}))


@pytest.mark.parametrize(
    "state", [b"\x80\x05Nr\x00\xe1\xf5\x05.", b"Np100000000\n.", b"Nq\x07.", bytes(2_000_000)]
)
def test_a_checkpoint_that_would_exhaust_the_memory_is_rejected(state):
    with pytest.raises(StreamError, match=r"too large|invalid opcode"):
        restore_session(state)


@pytest.mark.parametrize("name", ["snapshot_of", "math.isfinite", "annotations", "NamedTuple", "BoardState"])
def test_only_classes_that_an_allowed_module_defines_are_restored(name):
    with pytest.raises(StreamError, match="not allowed"):
        restore_session(f"cpneuforce.instrument.core.snapshot\n{name}\n(tR.".encode())


@pytest.mark.parametrize(
    "module",
    [
        "pneuforce.instrument.rig.usb_device",
        "pneuforce.instrument.recording.writer",
        "pneuforce.instrument.core_settings",
    ],
)
def test_a_module_that_is_not_allowed_is_not_imported(monkeypatch, module):
    monkeypatch.delitem(sys.modules, module, raising=False)
    with pytest.raises(StreamError, match="not allowed"):
        restore_session(f"c{module}\nSettings\n.".encode())
    assert module not in sys.modules


@pytest.mark.parametrize("name", ["settings", "core", "rig"])
def test_a_module_with_a_similar_name_is_not_imported(tmp_path, monkeypatch, name):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / f"{name}.py").write_text("class Settings: pass\n")
    with pytest.raises(StreamError, match="not allowed"):
        restore_session(f"c{name}\nSettings\n.".encode())
    assert name not in sys.modules


def test_a_damaged_checkpoint_raises_nothing_but_a_stream_error():
    state = save_session(Session(InstrumentHarness.holding().instrument))
    chance = random.Random(1)
    rejected = 0
    for _ in range(500):
        damaged = bytearray(state[: chance.randrange(1, len(state))] if chance.random() < 0.3 else state)
        damaged[chance.randrange(len(damaged))] ^= 1 << chance.randrange(8)
        try:
            restore_session(bytes(damaged))
        except StreamError:
            rejected += 1
    assert rejected > 100
