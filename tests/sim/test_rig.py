"""The whole simulated rig in virtual time."""

import time

import pytest

from instrument.rig.frames import (
    BoardState,
    Command,
    CommandFlag,
    Decoder,
    Identify,
    Mode,
    Sample,
    encode,
)
from sim.hand import Hand
from sim.published import PublishedPlant
from sim.rig import STEP_S, Rig

PLANT = PublishedPlant()


def drive(rig, seconds, setpoint_pa=8000):
    """Frames of a rig that is greeted, zeroed, inflated and kept alive; its bytes; the truth per sample."""
    decoder, frames, sent, truths = Decoder.of_board(), [], [], {}
    for n in range(round(seconds / STEP_S)):
        received = encode(Identify(), 0) if n == 0 else b""
        if n % 25 == 1:
            mode = Mode.VENT if n * STEP_S < 1 else Mode.HOLD
            received = encode(Command(mode, CommandFlag.ZEROED, setpoint_pa, 250), n)
        out = rig.step(received)
        sent.append(out)
        frames += decoder.feed(out)
        truths[rig.truth.sample & 0xFFFF] = rig.truth
    return frames, sent, truths


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not():
    once, again, other = (drive(Rig(PLANT, Hand(True), seed), 8)[1] for seed in (1, 1, 2))
    assert once == again
    assert once != other


@pytest.mark.parametrize("setpoint_pa", [2000, 5000, 8000, 8850, 12000])
def test_it_inflates_to_the_setpoint_and_locks(setpoint_pa):
    rig = Rig(PLANT, Hand(False))
    frames, _, _ = drive(rig, 10, setpoint_pa)
    assert frames[-1].message.state == BoardState.HOLDING
    assert rig.truth.balloon_kpa == pytest.approx(setpoint_pa / 1e3, abs=0.1)


def test_the_hand_presses_again_and_again_and_nothing_trips():
    rig = Rig(PLANT, Hand(True))
    frames, _, truths = drive(rig, 100)
    assert frames[-1].message.faults == 0
    assert max(truth.force_n for truth in truths.values()) == pytest.approx(3.0)
    assert rig.truth.radius_mm == pytest.approx(8.24, abs=0.02)


def test_the_truth_belongs_to_the_sample_of_the_same_count():
    rig = Rig(PLANT, Hand(True))
    frames, _, truths = drive(rig, 8)
    samples = [f for f in frames if isinstance(f.message, Sample)]
    assert [f.sequence for f in samples] == list(range(1, len(samples) + 1))
    for frame in samples:
        truth = truths[frame.sequence]
        assert truth.t_s * 1e6 == pytest.approx(frame.message.board_time_us)


def test_pressing_far_too_hard_trips_the_board_and_the_balloon_is_vented():
    rig = Rig(PLANT, Hand(False))
    drive(rig, 6)
    rig.hand.press(20)
    for n in range(2000):
        rig.step(encode(Command(Mode.HOLD, CommandFlag.ZEROED, 8000, 250), n) if n % 25 == 0 else b"")
    assert not rig.board.holds
    assert rig.truth.balloon_kpa < 0.5


def test_it_runs_at_least_20_times_faster_than_time():
    rig = Rig(PLANT, Hand(True))
    rig.step(encode(Identify(), 0))
    start_s = time.process_time()
    for _ in range(5000):
        rig.step()
    assert 5000 * STEP_S / (time.process_time() - start_s) > 20
