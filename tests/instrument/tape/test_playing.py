"""A recording keeps the pace of a clock, and nothing shown is older than it says."""

import pytest

from instrument.played import Played
from instrument.tape.entry import Kind, TapeError
from instrument.tape.playing import MOST_AT_ONCE, Playing
from tests.instrument.tape.virtual_host import PLC, coupling, inputs, play, playing


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_it_keeps_its_pace(speed):
    begun_s = inputs()[0].t_s
    found = play(playing(speed=speed), 2.0 / speed)
    assert len(found) == pytest.approx(1000, abs=25)
    for now_s, sample in found:
        due_s = (now_s - 50.0) * speed
        assert due_s - 0.005 * speed - 1e-6 <= sample.t_s - begun_s <= due_s + 1e-6


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
