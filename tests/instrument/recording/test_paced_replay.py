"""Tests of the paced replay: it follows a clock, and shows no old value even if it is too slow."""

import pytest

from pneuforce.instrument.recording.paced_replay import MAX_ENTRIES_PER_CALL, PacedReplay
from pneuforce.instrument.recording.replay_source import ReplaySource
from pneuforce.instrument.stream.entry import EntryKind, StreamError
from tests.instrument.recording.virtual_host import PLC, advance, inputs, make_replay, session


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_a_replay_follows_the_clock(speed):
    begin_s = inputs()[0].t_s
    replayed = advance(make_replay(speed=speed), 2.0 / speed)
    assert len(replayed) == pytest.approx(1000, abs=25)
    for now_s, sample in replayed:
        due_s = (now_s - 50.0) * speed
        assert due_s - 0.005 * speed - 1e-6 <= sample.t_s - begin_s <= due_s + 1e-6


def test_a_replay_with_repeat_starts_again_at_its_end():
    short = inputs()[:1000]
    replay = PacedReplay(lambda: (session(), iter(short)), repeat=True)
    sequences = [sample.raw.sequence for _, sample in advance(replay, 6.0)]
    assert sequences.count(sequences[0]) >= 3
    assert len(sequences) <= 3000
    assert not replay.finished


def test_a_slow_machine_replays_slower_and_shows_no_old_value():
    replay = make_replay(speed=100.0)
    source = ReplaySource(replay)
    list(replay.advance(0.0))
    for step in range(1, 5):
        assert len(list(replay.advance(step))) <= MAX_ENTRIES_PER_CALL
        assert source.snapshot(PLC, 0.0).age_s < 0.02
    assert replay.total_lag_s > 3.0


def test_a_pause_is_not_caught_up_at_a_higher_speed():
    replay = make_replay()
    advance(replay, 1.0, 0.0)
    advance(replay, 0.01, 100.0)
    assert len(advance(replay, 0.2, 100.01)) <= 110


def test_the_recorded_time_advances_between_two_entries():
    tick = next(entry for entry in inputs() if entry.kind is EntryKind.TICK)
    replay = PacedReplay(lambda: (session(), iter((tick, tick._replace(t_s=tick.t_s + 1.0)))), speed=2.0)
    list(replay.advance(7.0))
    list(replay.advance(7.25))
    assert replay.t_s == pytest.approx(tick.t_s + 0.5)
    assert replay.clock_time_s(replay.t_s) == pytest.approx(7.25)


def test_a_recording_without_inputs_is_rejected():
    with pytest.raises(StreamError, match="no inputs"):
        PacedReplay(lambda: (session(), iter(())))
