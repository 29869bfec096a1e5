"""Tests with samples that only a defective board sends: a wrong clock, or a state that changes too often.

All samples are bytes of the protocol with a valid CRC.
"""

import math
import random

import pytest

from pneuforce.instrument.core.faults import HostFault
from pneuforce.protocol.frames import BoardState
from tests.instrument.forged_board import ForgedBoard
from tests.instrument.instrument_harness import VENT

WRAP_US = 2**32


def after(start, change):
    """Return board times of an honest clock up to a sample, then `change(count)` instead of 2 ms per sample.

    The count starts with 1 at the first changed sample.
    """
    return lambda number: 2000 * min(number, start) + (change(number - start) if number > start else 0)


def stepped(*steps_us):
    """Return a clock that advances by these steps in turn."""
    return lambda count: sum(steps_us[n % len(steps_us)] for n in range(count))


WRONG_CLOCKS = {
    "backwards by 1 ms": stepped(-1000),
    "backwards by 2 ms": stepped(-2000),
    "backwards by 1 µs": stepped(-1),
    "stopped": stepped(0),
    "stopped for nine samples, then ahead": stepped(0, 0, 0, 0, 0, 0, 0, 0, 0, 20_000),
    "ahead by 1 s": stepped(1_000_000),
    "ahead by half the range": stepped(WRAP_US // 2),
    "twice as fast": stepped(4000),
    "half as fast": stepped(1000),
    "forward and backward": stepped(102_000, -98_000),
    "one wrong step in four": stepped(2000, 2000, 2000, 50_000),
    "random": lambda count: random.Random(count).getrandbits(32),
}


@pytest.mark.parametrize("clock", WRONG_CLOCKS.values(), ids=WRONG_CLOCKS)
def test_a_wrong_clock_of_the_board_trips_within_a_tenth_of_a_second(clock):
    board = ForgedBoard.holding()
    board.time_us_of = after(board.number, clock)
    assert board.run_until_tripped() <= 0.1
    assert board.snapshot().faults == (HostFault.BOARD_UNRESPONSIVE,)
    assert board.snapshot().state == "tripped"


@pytest.mark.parametrize("clock", WRONG_CLOCKS.values(), ids=WRONG_CLOCKS)
def test_samples_with_a_wrong_time_show_no_valid_force(clock):
    board = ForgedBoard.holding()
    before = board.snapshot().sample_counter
    board.time_us_of = after(board.number, clock)
    for _ in range(1000):
        board.step()
        seen = board.snapshot()
        assert "force_valid" not in seen.status or seen.sample_counter <= before + 30
    assert "force_valid" not in board.snapshot().status
    assert math.isnan(board.snapshot().force_n)


@pytest.mark.parametrize(("frames", "limit_s"), [(13, 0.3), (100, 0.1), (30_000, 0.1)])
def test_a_clock_that_jumps_together_with_the_sequence_numbers_trips(frames, limit_s):
    """Each step looks like lost frames, but no board can take so many samples in so little time."""
    board = ForgedBoard.holding()
    start = board.number
    board.sequence_of = lambda number: start + (number - start) * frames
    board.time_us_of = lambda number: 2000 * board.sequence_of(number)
    assert board.run_until_tripped() <= limit_s
    assert HostFault.BOARD_UNRESPONSIVE in board.snapshot().faults


def test_a_clock_that_jumps_once_and_then_runs_normally_trips():
    """The firmware halts instead of sending such a time, so the board is defective."""
    board = ForgedBoard.holding()
    start = board.number
    board.time_us_of = lambda number: 2000 * number + (1_000_000 if number > start else 0)
    assert board.run_until_tripped() <= 0.1


class TestHonestClocks:
    """Tests of samples that must not trip the rig."""

    @pytest.mark.parametrize("start_us", [0, WRAP_US - 4_000_000, 4_000_000_000])
    def test_a_wrap_of_the_clock(self, start_us):
        board = ForgedBoard.holding(time_us_of=lambda number: start_us + 2000 * number)
        board.run(3.0)
        assert board.snapshot().faults == ()

    @pytest.mark.parametrize("step_us", [1960, 1980, 2020, 2040])
    def test_a_clock_with_a_rate_error(self, step_us):
        board = ForgedBoard.holding(time_us_of=lambda number: step_us * number)
        board.run(20.0)
        assert board.snapshot().faults == ()
        assert "force_valid" in board.snapshot().status

    def test_a_clock_with_jitter(self):
        board = ForgedBoard.holding()
        board.time_us_of = lambda number: 2000 * number + random.Random(number).randint(-40, 40)
        board.run(5.0)
        assert board.snapshot().faults == ()

    @pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
    def test_lost_frames(self, share):
        board, lost = ForgedBoard.holding(), random.Random(1)
        send = board.send
        board.send = lambda data: None if lost.random() < share else send(data)
        board.run(5.0)
        assert board.snapshot().faults == ()
        assert board.session.link.implausible_frames == 0

    @pytest.mark.parametrize("stall_s", [0.05, 0.2, 0.9, 1.5])
    def test_all_samples_of_a_stall_of_the_host_in_one_read(self, stall_s):
        board = ForgedBoard.holding()
        for _ in range(5):
            waiting, send = [], board.send
            board.send = waiting.append
            for _ in range(round(stall_s / 0.002)):
                board.now_s += 0.002
                board.number += 1
                board.send_sample()
            board.send = send
            board.send(b"".join(waiting))
            board.run(1.0)
        assert board.snapshot().faults == ()

    @pytest.mark.parametrize(
        "odd",
        [
            {"board_time_us": 0},
            {"board_time_us": 0xFFFF_FFFF},
            {"board_time_us": 0x8000_0000, "adc_sum": 16_000},
            {"board_time_us": 77, "state": BoardState.VENTED},
        ],
    )
    def test_one_odd_sample_in_a_hundred_is_not_used(self, odd):
        board = ForgedBoard.holding()
        implausible = board.session.link.implausible_frames
        for _ in range(10):
            board.run(0.2)
            board.number += 1
            board.now_s += 0.002
            board.send_sample(**odd)
        board.run(0.01)
        seen = board.snapshot()
        assert (seen.faults, seen.state) == ((), "holding")
        assert seen.pressure_kpa == pytest.approx(8.0, abs=0.01)
        assert {"force_valid"} <= seen.status
        assert board.session.link.implausible_frames == implausible + 10

    @pytest.mark.parametrize("ahead", [100, 20_000])
    def test_one_odd_sequence_number_does_not_lose_the_next_samples(self, ahead):
        board = ForgedBoard.holding()
        odd = board.number + 50
        board.sequence_of = lambda number: number + (ahead if number == odd else 0)
        counter = board.snapshot().sample_counter
        board.run(1.0)
        assert board.snapshot().faults == ()
        assert board.snapshot().sample_counter == counter + 499


S = BoardState
FLAPS = {
    "holding, vented": (S.HOLDING, S.VENTED),
    "holding, venting": (S.HOLDING, S.VENTING),
    "holding, boot": (S.HOLDING, S.BOOT),
    "holding, tripped": (S.HOLDING, S.TRIPPED),
    "holding, settling": (S.HOLDING, S.SETTLING),
    "holding, inflating": (S.HOLDING, S.INFLATING),
    "mostly holding": (S.HOLDING, S.HOLDING, S.HOLDING, S.HOLDING, S.HOLDING, S.VENTED),
    "mostly vented": (S.VENTED, S.VENTED, S.VENTED, S.VENTED, S.HOLDING),
    "all": tuple(S),
}


def flapping(board, states, samples):
    """Let the board report these states in turn, each for a number of samples, from the next sample on."""
    start = board.number + 1
    board.state_of = lambda number, _: states[(number - start) // samples % len(states)]
    return board


class TestFlappingStates:
    """Tests of a board that reports no fault, but whose state changes too often."""

    @pytest.mark.parametrize(("samples", "limit_s"), [(1, 0.2), (2, 0.3), (5, 1.0), (25, 1.5)])
    @pytest.mark.parametrize("states", FLAPS.values(), ids=FLAPS)
    def test_a_state_that_changes_often_trips(self, states, samples, limit_s):
        board = flapping(ForgedBoard.holding(), states, samples)
        assert board.run_until_tripped() <= limit_s
        assert board.snapshot().faults == (HostFault.DISAGREEMENT,)

    @pytest.mark.parametrize("samples", [100, 250, 400])
    def test_a_state_that_changes_slowly_trips(self, samples):
        board = flapping(ForgedBoard.holding(), (S.VENTED, S.HOLDING), samples)
        assert board.run_until_tripped() <= 2.0

    @pytest.mark.parametrize(
        ("states", "samples"),
        [*((states, samples) for states in FLAPS for samples in (1, 25)), ("all", 2), ("all", 10)],
    )
    def test_no_force_is_valid_while_the_state_flaps(self, states, samples):
        board = flapping(ForgedBoard.holding(), FLAPS[states], samples)
        board.run(len(FLAPS[states]) * samples * 0.002)
        for _ in range(1500):
            board.step()
            seen = board.snapshot()
            assert "force_valid" not in seen.status
            assert math.isnan(seen.force_n)
            assert math.isnan(board.session.instrument.measurement.force_n)

    @pytest.mark.parametrize("samples", [1, 2, 10, 25])
    def test_a_vented_board_whose_state_flaps_trips(self, samples):
        board = ForgedBoard()
        board.run(2.0)
        flapping(board, (S.VENTED, S.HOLDING), samples)
        assert board.run_until_tripped() <= 1.0
        assert HostFault.NOT_VENTED in board.snapshot().faults

    def test_a_board_that_holds_without_a_command_shows_no_valid_force(self):
        board = ForgedBoard()
        board.run(2.0)
        board.state_of = lambda *_: S.HOLDING
        for _ in range(1000):
            board.step()
            assert "force_valid" not in board.snapshot().status
        assert board.snapshot().faults == (HostFault.NOT_VENTED,)

    def test_the_force_is_valid_until_the_board_vents(self):
        board = ForgedBoard.holding()
        board.state_of = lambda *_: S.HOLDING
        board.write_ok(VENT)
        board.run(0.05)
        assert "force_valid" in board.snapshot().status

    def test_one_odd_state_does_not_trip(self):
        board = ForgedBoard.holding()
        start = board.number
        board.state_of = lambda number, state: S.VENTED if (number - start) % 500 == 7 else state
        board.run(10.0)
        assert board.snapshot().faults == ()

    def test_a_peer_that_toggles_the_mode_trips_nothing(self):
        board = ForgedBoard()
        board.run(2.0)
        for _ in range(200):
            for request in ({"mode": "vent"}, {"mode": "hold", "setpoint_requested_kpa": 8.0}):
                board.write_ok(request)
                board.run(0.03)
        assert board.snapshot().faults == ()
