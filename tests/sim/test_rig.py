"""Tests of the simulated rig in virtual time."""

import math

import pytest

from pneuforce.protocol.frames import (
    BoardState,
    Command,
    CommandFlag,
    FrameDecoder,
    Hello,
    Identify,
    Image,
    Mode,
    Sample,
    encode,
)
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.pneumatics import PneumaticSettings
from pneuforce.sim.rig import STEP_S, Rig
from pneuforce.sim.sensor import SensorSettings

PLANT = PublishedPlant()


def drive(rig, seconds, setpoint_pa=8000):
    """Identify, zero, inflate and hold. Return frames, sent bytes, and the true state of each sample."""
    decoder, frames, sent, truths = FrameDecoder.for_board_frames(), [], [], {}
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
def test_the_rig_inflates_to_the_setpoint_and_holds(setpoint_pa):
    rig = Rig(PLANT, Hand(False))
    frames, _, _ = drive(rig, 10, setpoint_pa)
    assert frames[-1].message.state == BoardState.HOLDING
    assert rig.truth.balloon_kpa == pytest.approx(setpoint_pa / 1e3, abs=0.1)


def test_repeated_contacts_do_not_trip_the_rig():
    rig = Rig(PLANT, Hand(True))
    frames, _, truths = drive(rig, 100)
    assert frames[-1].message.faults == 0
    assert max(truth.force_n for truth in truths.values()) == pytest.approx(2.7)
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
    assert not rig.board.is_holding
    assert rig.truth.balloon_kpa < 0.5


def rig_with_all_effects(seed):
    """Return a rig with all effects enabled."""
    rig = Rig(
        PLANT,
        Hand(True),
        seed,
        PneumaticSettings(
            polytropic=1.2,
            creep=0.02,
            ambient_drift_kpa_per_s=1e-4,
            ambient_swing_kpa=0.05,
            reference_kpa=0.2,
        ),
        SensorSettings(gain_error=0.005, bow_kpa=-0.2, ripple_mv=20.0),
    )
    rig.pneumatics.balloon_temperature.target_k = 15.0
    rig.pneumatics.circuit_temperature.target_k = 2.0
    rig.clock_rate = 1.005
    return rig


def test_with_all_effects_the_rig_works_and_the_same_seed_gives_the_same_bytes():
    frames, once, _ = drive(rig_with_all_effects(1), 12)
    assert drive(rig_with_all_effects(1), 12)[1] == once
    assert drive(rig_with_all_effects(2), 12)[1] != once
    assert frames[-1].message.state == BoardState.HOLDING
    assert frames[-1].message.board_time_us == pytest.approx(12.06e6, rel=1e-6)
    assert len({f.message.supply_mv for f in frames if isinstance(f.message, Sample)}) > 5


def test_the_frames_contain_the_supply_voltage_and_the_sum_does_not_depend_on_it():
    rig = Rig(PLANT, Hand(False))
    before = drive(rig, 6)[0][-1].message
    rig.supply_mv = 4800
    for _ in range(50):
        sample = FrameDecoder.for_board_frames().feed(rig.step())[0].message
    assert sample.supply_mv == 4800
    assert sample.adc_sum == pytest.approx(before.adc_sum, abs=20)


def test_after_a_reset_the_board_boots_and_the_balloon_empties():
    rig = Rig(PLANT, Hand(False))
    drive(rig, 6)
    rig.reset_board()
    image, hello = (frame.message for frame in FrameDecoder.for_board_frames().feed(rig.step())[:2])
    assert (type(image), type(hello)) == (Image, Hello)
    assert hello.uptime_ms == 2
    for _ in range(1000):
        rig.step()
    assert rig.truth.t_s == pytest.approx(2.002)
    assert rig.truth.balloon_kpa < 0.5


def test_the_clock_of_a_frozen_board_is_stopped():
    rig = Rig(PLANT, Hand(False))
    drive(rig, 2)
    rig.frozen_board = True
    samples = [FrameDecoder.for_board_frames().feed(rig.step())[0].message for _ in range(5)]
    assert {sample.board_time_us for sample in samples} == {2_000_000}


def test_the_truth_describes_the_balloon_while_the_tube_is_occluded():
    rig = Rig(PLANT, Hand(False))
    drive(rig, 6)
    rig.pneumatics.occluded = True
    for n in range(1000):
        rig.step(encode(Command(Mode.VENT), n))
    assert rig.pneumatics.sensor_kpa < 0.1
    assert rig.truth.balloon_kpa == pytest.approx(rig.truth.baseline_kpa) == pytest.approx(8, abs=0.1)
    assert rig.truth.volume_mm3 == pytest.approx(4 / 3 * math.pi * rig.truth.radius_mm**3)


def test_creep_makes_the_balloon_larger_at_the_same_pressure():
    rig = Rig(PLANT, Hand(False), pneumatics=PneumaticSettings(creep=0.03, creep_s=0.5))
    drive(rig, 10)
    truth = rig.truth
    assert truth.radius_mm == pytest.approx(PLANT.radius_mm(truth.balloon_kpa) * 1.03 ** (1 / 3), rel=1e-3)
    assert truth.volume_mm3 == pytest.approx(4 / 3 * math.pi * truth.radius_mm**3)
