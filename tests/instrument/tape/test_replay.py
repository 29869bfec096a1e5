"""What went in once more gives what came out, to the last bit."""

import json
from itertools import pairwise

import pytest

from instrument.faults import HostFault
from instrument.played import Played
from instrument.refusal import Refusal
from instrument.tape.checkpoint import thaw
from instrument.tape.entry import INPUTS, Entry, Kind, TapeError
from instrument.tape.measured import unpack
from instrument.tape.playing import MOST_AT_ONCE, Playing
from instrument.tape.replay import check_version, compared, difference, feed
from tests.instrument.tape.virtual_host import PAGE, PLC, ROBOT, eventful


def inputs():
    return [entry for entry in eventful()[1].entries if entry.kind in INPUTS]


def samples():
    return [unpack(entry.body) for entry in eventful()[1].entries if entry.kind is Kind.MEASURED]


def coupling():
    return thaw(eventful()[1].checkpoint)


def differences(entries, recorded):
    return [found.difference for found in compared(coupling(), entries, recorded)]


def first_difference(entries):
    return next((found for found in differences(entries, samples()) if found), None)


# ---- verified


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


# ---- played


def playing(**how):
    return Playing(lambda: (coupling(), iter(inputs())), **how)


def play(show, until_s, begin_s=50.0, step_s=0.005):
    """Advance by the clock; what was measured, with the time of the clock."""
    found, now_s = [], begin_s
    while now_s < begin_s + until_s:
        found += [(now_s, sample) for sample in show.advance(now_s)]
        now_s += step_s
    return found


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_it_keeps_its_pace(speed):
    begun_s = inputs()[0].t_s
    found = play(playing(speed=speed), 2.0 / speed)
    assert len(found) == pytest.approx(1000, abs=25)
    for now_s, sample in found:
        due_s = (now_s - 50.0) * speed
        assert due_s - 0.005 * speed - 1e-6 <= sample.t_s - begun_s <= due_s + 1e-6


def test_what_a_bus_sees_is_what_was_measured_then():
    show = playing()
    shown, recorded = Played(show), {sample.t_s: sample for sample in samples()}
    play(show, 2.5)
    seen = shown.snapshot(PLC, 123.0)
    was = recorded[show.coupling.instrument.measurement.t_s]
    assert (seen.force_n, seen.pressure_kpa, seen.radius_mm) == (was.force_n, was.pressure_kpa, was.radius_mm)
    assert seen.age_s < 0.02


def test_a_lease_runs_as_it_ran():
    """Recorded while the lease of 1 s ran: half a second of it is over after a quarter at twice the speed."""
    entries = inputs()
    taken_s = next(e.t_s for e in entries if e.kind is Kind.WRITE and "lease_s" in json.loads(e.body)[2])
    show = playing(speed=2.0)
    shown, now_s = Played(show), 0.0
    while not shown.snapshot(PLC, now_s).lease_left_s > 0.9:
        now_s += 0.002
        list(show.advance(now_s))
    assert show.t_s == pytest.approx(taken_s, abs=0.02)
    play(show, 0.25, now_s)
    assert shown.snapshot(PLC, now_s).lease_left_s == pytest.approx(0.5, abs=0.05)


def test_no_robot_takes_it_for_a_rig():
    show = playing()
    shown = Played(show)
    for step in range(2000):
        list(show.advance(step * 0.01))
        assert shown.snapshot(ROBOT, 0.0).status >= {"simulated", "function_check", "write_lock"}


def test_writes_are_refused_and_change_nothing_but_a_vent_is_accepted():
    show = playing()
    shown = Played(show)
    play(show, 0.5)
    before = show.coupling.instrument.snapshot(PLC, show.t_s)
    assert shown.write(PLC, {"setpoint_requested_kpa": 5.0}, 0.0) == "write_lock"
    assert shown.snapshot(PLC, 0.0).refusal is Refusal.WRITE_LOCK
    assert shown.snapshot(ROBOT, 0.0).refusal is Refusal.NONE
    assert shown.write(PLC, {"mode": "hold"}, 0.0) == "write_lock"
    assert shown.write(PLC, {"mode": "vent", "lease_s": 1.0}, 0.0) == "write_lock"
    assert shown.write(PLC, {"mode": "vent"}, 0.0) == "none"
    assert shown.snapshot(PLC, 0.0).refusal is Refusal.NONE
    assert repr(show.coupling.instrument.snapshot(PLC, show.t_s)) == repr(before)


def test_after_its_end_the_link_is_lost_and_nothing_is_available():
    short = inputs()[:1000]
    show = Playing(lambda: (coupling(), iter(short)))
    shown = Played(show)
    play(show, 1.0)
    assert not show.over
    assert shown.snapshot(PLC, 0.0).force_n >= 0
    play(show, 4.0, 51.0)
    assert show.over
    seen = shown.snapshot(PLC, 0.0)
    assert seen.status >= {"stale", "link_lost", "simulated", "failure"}
    assert seen.force_n != seen.force_n
    assert seen.age_s > 1.0
    assert seen.state == "tripped"
    assert HostFault.LINK_LOST in seen.faults


def test_it_begins_again_where_that_is_wanted():
    short = inputs()[:1000]
    show = Playing(lambda: (coupling(), iter(short)), again=True)
    found = [sample.raw.sequence for _, sample in play(show, 6.0)]
    assert found.count(found[0]) >= 3
    assert len(found) <= 3000
    assert not show.over


def test_a_machine_that_is_too_slow_plays_slower_and_shows_no_old_value():
    show = playing(speed=100.0)
    shown = Played(show)
    list(show.advance(0.0))
    for step in range(1, 5):
        assert len(list(show.advance(step))) <= MOST_AT_ONCE
        assert shown.snapshot(PLC, 0.0).age_s < 0.02
    assert show.slipped_s > 3.0


def test_what_was_missed_is_not_made_up_for_in_a_rush():
    show = playing()
    play(show, 1.0, 0.0)
    play(show, 0.01, 100.0)
    assert len(play(show, 0.2, 100.01)) <= 110


def test_the_recorded_time_goes_on_where_nothing_happens():
    beat = next(entry for entry in inputs() if entry.kind is Kind.BEAT)
    show = Playing(lambda: (coupling(), iter((beat, beat._replace(t_s=beat.t_s + 1.0)))), speed=2.0)
    list(show.advance(7.0))
    list(show.advance(7.25))
    assert show.t_s == pytest.approx(beat.t_s + 0.5)
    assert show.live_s(show.t_s) == pytest.approx(7.25)


def test_a_recording_in_which_nothing_came_is_not_played():
    with pytest.raises(TapeError, match="nothing to play"):
        Playing(lambda: (coupling(), iter(())))
