"""Tests of forged checkpoints: each is rejected, or gives a session, in bounded time and memory."""

import json
import pickle
import random
import time
import timeit
import tracemalloc
from functools import cache

import pytest

from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.checkpoint import MAX_BYTES, restore_session, save_session
from pneuforce.instrument.stream.entry import StreamError
from tests.instrument.instrument_harness import InstrumentHarness
from tests.instrument.recording.virtual_host import VirtualHost

#: Largest processor time, as a multiple of the time in which the JSON library reads many lists.
MAX_TIME_RATIO = 6
MAX_MEMORY_BYTES = 50_000_000
MUTATIONS = 4_000
REMOVED = object()
DEEP = 200_000


@cache
def valid():
    return save_session(Session(InstrumentHarness.holding().instrument))


def restored(state):
    """Return the restored session, or None if the checkpoint is rejected."""
    try:
        return restore_session(state)
    except StreamError:
        return None


def used_s(function, state):
    """Return the shortest processor time that a function used in three calls."""
    return min(timeit.repeat(lambda: function(state), timer=time.thread_time, number=1, repeat=3))


def changed(*path, to):
    """Return a valid checkpoint in which the value at `path` is replaced."""
    document = json.loads(valid())
    part = document
    for name in path[:-1]:
        part = part[name]
    if to is REMOVED:
        del part[path[-1]]
    else:
        part[path[-1]] = to
    return json.dumps(document).encode()


def with_text(text, *path):
    """Return a valid checkpoint in which the value at `path` is replaced by a JSON text."""
    return changed(*path, to="replaced here").replace(b'"replaced here"', text)


def records():
    """Return the records of the peers in a valid checkpoint."""
    return json.loads(valid())["instrument"]["peers"]["_records"]


TREE = ("instrument", "chain")
COUNTER, BALLOON = ("instrument", "sample_counter"), ("instrument", "settings", "chain", "balloon")
NUMBER, ARRIVALS = ("heard_s",), ("link", "clock", "_arrivals")
#: 127 bytes: nested tuples whose hash takes 2 to the power of 60 steps.
NESTED_PICKLE = b"\x80\x05})" + b"2\x86" * 60 + b"Ns."
FORGED = {
    "nothing": b"",
    "a pickle with nested tuples": NESTED_PICKLE,
    "a pickle that calls a function": b"cos\nsystem\n(S'true'\ntR.",
    "another JSON value": b"[]",
    "null": b"null",
    "no text": b"\xff\xfe" * 1000,
    "too many bytes": b"[" + b"0," * MAX_BYTES + b"0]",
    "many empty lists": b"[" + b"[]," * (MAX_BYTES // 3 - 2) + b"[]]",
    "many empty objects": b"[" + b"{}," * (MAX_BYTES // 3 - 2) + b"{}]",
    "nested lists": b"[" * DEEP,
    "nested lists that end": b"[" * DEEP + b"]" * DEEP,
    "nested objects": b'{"a":' * (DEEP // 3),
    "a number with many digits": b"1" * (MAX_BYTES - 1),
    "a field with many digits": with_text(b"1" * 400_000, *COUNTER),
    "a fraction with many digits": with_text(b"0." + b"1" * 400_000, *NUMBER),
    "a large exponent": with_text(b"1e" + b"9" * 400_000, *BALLOON, "young_kpa"),
    "a number that is too large": changed(*COUNTER, to=2**63),
    "a field twice": valid().replace(b'"heard_s":', b'"heard_s":0.0,"heard_s":'),
    "a key twice": changed("instrument", "peers", "_records", to=2 * records()),
    "a missing field": changed(*TREE, "zero", to=REMOVED),
    "an unknown field": changed(*TREE, "write", to=1.0),
    "a field of another class": changed("instrument", "process", to=None),
    "a class": changed("instrument", "lease", to={"__class__": "Lease"}),
    "a text for a number": changed(*NUMBER, to="1.0"),
    "an integer for a number": changed(*NUMBER, to=1),
    "a number for an integer": changed(*COUNTER, to=1.0),
    "a logical value for an integer": changed(*COUNTER, to=True),
    "an integer for a logical value": changed("instrument", "can_down", to=1),
    "null for a number": changed(*NUMBER, to=None),
    "a list for an object": changed(*TREE, to=[]),
    "an object for a list": changed(*ARRIVALS, to={}),
    "a long list": changed(*ARRIVALS, to=[{"board_s": 0.0, "offset_s": 0.0}] * 1001),
    "a short tuple": changed("instrument", "lease", "holder", to=["web"]),
    "an unknown state": changed("instrument", "arming", to="ARMED"),
    "an unknown method": changed("instrument", "settings", "chain", "law", "method", to="force"),
    "an unknown quality": changed("instrument", "measurement", "quality", to=1 << 20),
    "a control character": changed("instrument", "requested", "mode", to="\x1b[2J"),
    "half a character": changed("instrument", "requested", "mode", to="\ud800"),
    "no bytes": changed("link", "decoder", "_buffer", to="x"),
    "NaN in the settings": changed(*BALLOON, "young_kpa", to=float("nan")),
    "infinity in a sample": changed("instrument", "raw", "t_s", to=float("inf")),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_checkpoint_is_rejected_in_bounded_time_and_memory(name):
    restored(valid())  # the first call allocates memory that stays
    tracemalloc.start()
    try:
        assert restored(FORGED[name]) is None
        memory_bytes = tracemalloc.get_traced_memory()[1]
        json_s = used_s(json.loads, FORGED["many empty lists"])
        assert used_s(restored, FORGED[name]) < MAX_TIME_RATIO * json_s
        assert memory_bytes < MAX_MEMORY_BYTES
    finally:
        tracemalloc.stop()


def test_the_unchanged_checkpoint_of_these_tests_is_accepted():
    same = changed(*COUNTER, to=json.loads(valid())["instrument"]["sample_counter"])
    assert save_session(restored(same)) == save_session(restored(valid())) == valid()


def test_numbers_that_are_not_finite_are_restored_if_they_are_measurements():
    session = restored(changed("instrument", "peak_force_n", to=float("inf")))
    assert session.instrument.peak_force_n == float("inf")


def test_each_truncated_checkpoint_is_rejected():
    state = valid()
    assert all(restored(state[:length]) is None for length in range(0, len(state), 7))


def mutated(chance):
    """Return a valid checkpoint with random changes, of which about half are still JSON."""
    state = bytearray(valid())
    for _ in range(chance.choice((1, 1, 1, 2, 5))):
        at = chance.randrange(len(state))
        match chance.randrange(5):
            case 0:
                state[at] ^= 1 << chance.randrange(8)
            case 1:
                state[at] = chance.choice(b'0123456789-.eE"[]{},:ntfNI ')
            case 2:
                del state[at : at + chance.randrange(1, 200)]
            case 3:
                state[at:at] = state[chance.randrange(len(state)) :][: chance.randrange(1, 200)]
            case 4:
                begin = state.find(b":", at) + 1
                state[begin : begin + chance.randrange(1, 6)] = chance.choice(
                    (
                        b"1e999",
                        b"NaN",
                        b"null",
                        b"-0",
                        b"[]",
                        b"{}",
                        b'""',
                        b"true",
                        b"9" * 30,
                        b"[[0]]",
                        b"0.0",
                    )
                )
    return bytes(state)


def test_a_random_change_gives_a_stream_error_or_a_session():
    chance, accepted = random.Random(1), 0
    for _ in range(MUTATIONS):
        session = restored(mutated(chance))
        if session is not None:
            accepted += 1
            save_session(session)
    assert 0 < accepted < MUTATIONS / 2


def test_a_checkpoint_with_the_largest_number_of_peers_is_accepted():
    host = VirtualHost()
    host.inflate()
    for number in range(300):
        values = {"setpoint_requested_kpa": 8.0 + number / 1000, "force_limit_n": 4.123456, "lease_s": 0.0}
        values |= {"reference_pressure_kpa": 0.0, "command_key": 1, "command_code": "self_test"}
        values |= {"command_argument": 0, "command_sequence": number, "mode": "hold"}
        host.write(values, ("modbus_tcp", f"192.168.100.{number}:50000"))
    state = save_session(host.session)
    assert len(state) < MAX_BYTES / 2
    assert save_session(restored(state)) == state


def test_a_checkpoint_is_no_pickle():
    with pytest.raises(pickle.UnpicklingError):
        pickle.loads(valid())
