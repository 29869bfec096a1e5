"""What went in once more gives what came out, to the last bit."""

from itertools import pairwise

import pytest

from instrument.tape.entry import INPUTS, Entry, Kind, TapeError
from instrument.tape.replay import check_version, compared, difference, feed
from tests.instrument.tape.virtual_host import PAGE, PLC, ROBOT, coupling, eventful, inputs, samples


def differences(entries, recorded):
    return [found.difference for found in compared(coupling(), entries, recorded)]


def first_difference(entries):
    return next((found for found in differences(entries, samples()) if found), None)


def test_a_recording_with_all_that_may_happen_is_the_same_again_to_the_last_bit():
    found = differences(inputs(), samples())
    assert len(found) > 14_000
    assert set(found) == {None}


def test_the_recording_has_in_it_what_it_is_meant_to_have():
    host, _ = eventful()
    measured = samples()
    assert measured[0].in_contact
    assert sum(not a.in_contact and b.in_contact for a, b in pairwise(measured)) >= 5
    assert {round(sample.setpoint_pa, -3) for sample in measured} >= {8000, 7000, 6000}
    assert host.damaged_bytes > 0
    assert host.coupling.link.lost_frames > 0
    assert host.coupling.link.board_restarts > 0
    assert {entry.kind for entry in inputs()} == set(map(Kind, INPUTS))
    heard = [entry for entry in inputs() if entry.kind is Kind.RECEIVED]
    assert any(0.5 < b.t_s - a.t_s < 0.7 and len(b.body) > 1000 for a, b in pairwise(heard))  # said at once


def test_all_that_a_bus_may_see_is_the_same_again_at_each_beat():
    host, _ = eventful()
    again, beats = coupling(), 0
    for entry in inputs():
        list(feed(again, entry))
        if entry.kind is Kind.BEAT:
            assert repr(again.instrument.snapshot(PAGE, entry.t_s)) == host.seen[entry.t_s]
            beats += 1
    assert beats > 2_500
    for peer in (PLC, ROBOT):
        seen = again.instrument.snapshot(peer, host.now_s)
        assert repr(seen) == repr(host.instrument.snapshot(peer, host.now_s))


def test_one_altered_byte_of_a_sample_is_found_where_it_is():
    entries = inputs()
    at = next(n for n, entry in enumerate(entries) if n > 9000 and entry.kind is Kind.RECEIVED)
    altered = bytearray(entries[at].body)
    altered[-1] ^= 1
    entries[at] = entries[at]._replace(body=bytes(altered))
    found = first_difference(entries)
    assert found.t_s == pytest.approx(entries[at].t_s, abs=0.02)
    assert f"(sequence {found.sequence})" in str(found)
    assert found.field in str(found)


def test_a_request_that_was_left_out_is_found():
    entries = [entry for entry in inputs() if entry.kind is not Kind.WRITE]
    assert first_difference(entries) is not None


def test_a_sample_that_nothing_brings_about_is_not_compared():
    found = differences(inputs()[:2000], samples())
    assert 500 < len(found) < len(samples())
    assert set(found) == {None}


def test_bytes_without_what_was_made_of_them_are_no_difference():
    assert set(differences(inputs(), samples()[:500])) == {None}


def test_not_a_number_is_the_same_as_itself_and_nothing_else():
    was = samples()[0]
    nothing = was._replace(force_n=float("nan"))
    assert difference(1, nothing, nothing._replace(force_n=float("-nan"))) is None
    assert difference(7, nothing, was).field == "force_n"
    assert difference(7, was, nothing).number == 7


def test_a_last_bit_is_a_difference():
    was = samples()[0]
    assert difference(1, was, was._replace(pressure_kpa=was.pressure_kpa * (1 + 2**-52))) is not None


@pytest.mark.parametrize("kind", sorted(set(Kind) - INPUTS))
def test_what_came_out_is_never_put_in(kind):
    with pytest.raises(TapeError, match="no input"):
        list(feed(coupling(), Entry(kind, 0.0)))


@pytest.mark.parametrize("body", [b"", b"{}", b"[]", b'["can", "", 7]', b"[1, 2, {}, 4]", b"\xff"])
def test_a_request_that_is_none_is_told_in_a_sentence(body):
    with pytest.raises(TapeError, match=r"WRITE at 1000\.000 s cannot be replayed"):
        list(feed(coupling(), Entry(Kind.WRITE, 1000.0, body)))


def test_only_the_same_version_and_map_are_replayed():
    check_version({"version": "1.2", "map_hash": "0badcafe"}, "1.2", "0badcafe")
    with pytest.raises(TapeError, match=r"pneuforce 1\.1, and this is 1\.2"):
        check_version({"version": "1.1", "map_hash": "0badcafe"}, "1.2", "0badcafe")
    with pytest.raises(TapeError, match="register map 00000000"):
        check_version({"version": "1.2", "map_hash": "00000000"}, "1.2", "0badcafe")
