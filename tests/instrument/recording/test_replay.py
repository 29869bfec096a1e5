"""Tests of the replay: the recorded inputs give the recorded samples, bit for bit."""

from itertools import pairwise

import pytest

from pneuforce.instrument.recording.replay import (
    WRITABLE_TYPES,
    check_version,
    compare_samples,
    first_difference,
    replay_input,
)
from pneuforce.instrument.stream.entry import INPUTS, EntryKind, StreamEntry, StreamError
from pneuforce.registers.map import REGISTERS
from tests.instrument.recording.virtual_host import PAGE, PLC, ROBOT, eventful, inputs, samples, session


def differences(entries, recorded):
    return [compared.difference for compared in compare_samples(session(), entries, recorded)]


def earliest_difference(entries):
    return next((difference for difference in differences(entries, samples()) if difference), None)


def test_a_replay_of_an_eventful_recording_is_equal_bit_for_bit():
    found = differences(inputs(), samples())
    assert len(found) > 14_000
    assert set(found) == {None}


def test_the_eventful_recording_contains_every_kind_of_input_and_failure():
    host, _ = eventful()
    measured = samples()
    assert measured[0].in_contact
    assert sum(not a.in_contact and b.in_contact for a, b in pairwise(measured)) >= 5
    assert {round(sample.setpoint_pa, -3) for sample in measured} >= {8000, 7000, 6000}
    assert host.damaged_bytes > 0
    assert host.session.link.lost_frames > 0
    assert host.session.link.board_restarts > 0
    assert {entry.kind for entry in inputs()} == set(map(EntryKind, INPUTS))
    received = [entry for entry in inputs() if entry.kind is EntryKind.RECEIVED]
    assert any(
        0.5 < b.t_s - a.t_s < 0.7 and len(b.body) > 1000 for a, b in pairwise(received)
    )  # the line held these bytes back for 0.6 s


def test_the_snapshots_for_the_buses_are_equal_at_each_tick():
    host, _ = eventful()
    replayed, ticks = session(), 0
    for entry in inputs():
        list(replay_input(replayed, entry))
        if entry.kind is EntryKind.TICK:
            assert repr(replayed.instrument.snapshot(PAGE, entry.t_s)) == host.snapshots[entry.t_s]
            ticks += 1
    assert ticks > 2_500
    for peer in (PLC, ROBOT):
        seen = replayed.instrument.snapshot(peer, host.now_s)
        assert repr(seen) == repr(host.instrument.snapshot(peer, host.now_s))


def test_a_changed_byte_of_a_sample_is_reported_at_its_sample():
    entries = inputs()
    at = next(n for n, entry in enumerate(entries) if n > 9000 and entry.kind is EntryKind.RECEIVED)
    altered = bytearray(entries[at].body)
    altered[-1] ^= 1
    entries[at] = entries[at]._replace(body=bytes(altered))
    found = earliest_difference(entries)
    assert found.t_s == pytest.approx(entries[at].t_s, abs=0.02)
    assert f"(sequence {found.sequence})" in str(found)
    assert found.field in str(found)


def test_a_missing_write_request_is_reported():
    entries = [entry for entry in inputs() if entry.kind is not EntryKind.WRITE]
    assert earliest_difference(entries) is not None


def test_samples_without_their_inputs_are_not_compared():
    found = differences(inputs()[:2000], samples())
    assert 500 < len(found) < len(samples())
    assert set(found) == {None}


def test_inputs_without_their_samples_are_not_a_difference():
    assert set(differences(inputs(), samples()[:500])) == {None}


def test_nan_equals_nan_and_differs_from_each_number():
    sample = samples()[0]
    without_force = sample._replace(force_n=float("nan"))
    assert first_difference(1, without_force, without_force._replace(force_n=float("-nan"))) is None
    assert first_difference(7, without_force, sample).field == "force_n"
    assert first_difference(7, sample, without_force).number == 7


def test_a_difference_of_the_last_bit_is_reported():
    sample = samples()[0]
    assert (
        first_difference(1, sample, sample._replace(pressure_kpa=sample.pressure_kpa * (1 + 2**-52)))
        is not None
    )


@pytest.mark.parametrize("kind", sorted(set(EntryKind) - INPUTS))
def test_only_inputs_are_replayed(kind):
    with pytest.raises(StreamError, match="not an input"):
        list(replay_input(session(), StreamEntry(kind, 0.0)))


@pytest.mark.parametrize(
    "body",
    [
        *(b"", b"{}", b"[]", b'["can", "", 7]', b"[1, 2, {}, 4]", b"\xff"),
        *(b'[[], "", {"mode": "vent"}]', b'["can", 1, {"mode": "vent"}]', b'["can", "", {"mode": 1}]'),
        *(b'["can", "", {"force_limit_n": []}]', b'["can", "", {"force_limit_n": "1"}]'),
        *(b'["can", "", {"lease_s": true}]', b'["can", "", {"x": 1}]', b'["can", "", ' + b"[" * 9000),
    ],
    ids=lambda body: body[:40],
)
def test_an_invalid_write_request_is_reported(body):
    with pytest.raises(StreamError, match=r"WRITE at 1000\.000 s cannot be replayed"):
        list(replay_input(session(), StreamEntry(EntryKind.WRITE, 1000.0, body)))


def test_each_writable_quantity_of_the_register_map_can_be_replayed():
    assert WRITABLE_TYPES.keys() == {register.quantity for register in REGISTERS if register.writable}


def test_only_the_same_version_and_register_map_are_replayed():
    check_version({"version": "1.2", "map_hash": "0badcafe"}, "1.2", "0badcafe")
    with pytest.raises(StreamError, match=r"pneuforce 1\.1, and this is pneuforce 1\.2"):
        check_version({"version": "1.1", "map_hash": "0badcafe"}, "1.2", "0badcafe")
    with pytest.raises(StreamError, match="register map 00000000"):
        check_version({"version": "1.2", "map_hash": "00000000"}, "1.2", "0badcafe")
