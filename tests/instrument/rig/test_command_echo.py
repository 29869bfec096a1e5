"""Tests of the command echo: delayed samples never look fresh, even if their board times are regular."""

from collections import deque

import pytest

from pneuforce.instrument.rig.command_echo import COMMAND_LATENCY_S, CommandEcho
from pneuforce.instrument.rig.link import Link
from pneuforce.protocol.frames import BoardKind, BoardState, Command, FrameDecoder, Hello, Sample, encode

STEP_S = 0.002


class Line:
    """Board that sends 500 samples per second over a line with a delay in each direction."""

    def __init__(self, up_s=0.003, down_s=0.001):
        self.up_s, self.down_s = up_s, down_s
        self.link = Link()
        self.link.feed(encode(Hello(BoardKind.REAL, 0x100, 1000, 7, 250, 2000), 0), 0.0)
        self._step = self._applied = 0
        self._up, self._down = deque(), deque()
        self._decoder = FrameDecoder.for_host_frames()

    def age_errors_s(self, seconds, lost=()):
        """Run for a time. Return the estimated age minus the true age [s] of each sample.

        `lost` contains the numbers of the steps whose commands do not reach the board.
        """
        errors_s = []
        for _ in range(round(seconds / STEP_S)):
            self._step += 1
            now_s = self._step * STEP_S
            data = self.link.tick(Command(), now_s)
            if data and self._step not in lost:
                self._up.append((now_s, data))
            while self._up and self._up[0][0] + self.up_s <= now_s:
                self._apply(self._up.popleft()[1])
            sample = Sample(self._step * 2000, 700, 5000, 0, BoardState.VENTED, 0, 0, self._applied, 0)
            self._down.append((now_s, encode(sample, self._step & 0xFFFF)))
            while self._down and self._down[0][0] + self.down_s <= now_s:
                taken_s, data = self._down.popleft()
                errors_s += [taken_s - raw.t_s for raw in self.link.feed(data, now_s)]
        return errors_s

    def _apply(self, data):
        for frame in self._decoder.feed(data):
            if isinstance(frame.message, Command):
                self._applied = frame.sequence & 0xFF


@pytest.mark.parametrize("lag_s", [0.1, 0.2, 0.4, 2.0])
def test_a_new_lag_of_the_line_increases_the_ages_while_it_lasts(lag_s):
    line = Line()
    line.age_errors_s(5.0)
    line.down_s = lag_s
    line.age_errors_s(lag_s + 0.2)
    # The estimated age can be too small by the time between two commands plus the latency of a command.
    assert min(line.age_errors_s(5.0)) >= -(0.05 + COMMAND_LATENCY_S + 2 * STEP_S)


def test_ages_are_small_again_after_the_lag():
    line = Line()
    line.age_errors_s(3.0)
    line.down_s = 0.3
    line.age_errors_s(2.0)
    line.down_s = 0.001
    assert max(line.age_errors_s(2.5)) <= 0.04
    assert max(map(abs, line.age_errors_s(2.0))) <= 0.004


@pytest.mark.parametrize("up_s", [0.001, 0.005, 0.018])
def test_without_a_lag_only_the_clock_determines_the_ages(up_s):
    line = Line(up_s)
    assert max(map(abs, line.age_errors_s(20.0))) <= 0.004


def test_lost_commands_do_not_make_samples_stale():
    line = Line()
    line.age_errors_s(1.0)
    assert max(line.age_errors_s(1.0, lost=range(600, 630))) <= 0.1


def test_samples_without_an_echo_count_as_old_and_memory_stays_limited():
    echo = CommandEcho()
    for n in range(1000):
        echo.command_sent(2 * n + 1, n * 0.05)
    assert echo.latest_s(0) < 1000 * 0.05 - 5.0
    assert echo.latest_s(1999 & 0xFF) == float("inf")
