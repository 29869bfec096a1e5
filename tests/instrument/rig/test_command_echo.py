"""A line that delays all bytes: what comes late never looks fresh, though its clock runs on evenly."""

from collections import deque

import pytest

from instrument.rig.echo import WAY_UP_S, CommandEcho
from instrument.rig.frames import BoardKind, BoardState, Command, Decoder, Hello, Sample, encode
from instrument.rig.link import Link

STEP_S = 0.002


class Line:
    """A board that streams 500 samples a second over a line with a delay each way, in made-up time."""

    def __init__(self, up_s=0.003, down_s=0.001):
        self.up_s, self.down_s = up_s, down_s
        self.link = Link()
        self.link.feed(encode(Hello(BoardKind.REAL, 0x100, 1000, 7, 250, 2000), 0), 0.0)
        self._step = self._obeyed = 0
        self._up, self._down = deque(), deque()
        self._heard = Decoder.of_host()

    def ages(self, seconds, lost=()):
        """Age [s] that each sample shows when it is read, less the age that it has."""
        wrong_s = []
        for _ in range(round(seconds / STEP_S)):
            self._step += 1
            now_s = self._step * STEP_S
            data = self.link.tick(Command(), now_s)
            if data and self._step not in lost:
                self._up.append((now_s, data))
            while self._up and self._up[0][0] + self.up_s <= now_s:
                self._obey(self._up.popleft()[1])
            sample = Sample(self._step * 2000, 700, 5000, 0, BoardState.VENTED, 0, 0, self._obeyed, 0)
            self._down.append((now_s, encode(sample, self._step & 0xFFFF)))
            while self._down and self._down[0][0] + self.down_s <= now_s:
                taken_s, data = self._down.popleft()
                wrong_s += [taken_s - raw.t_s for raw in self.link.feed(data, now_s)]
        return wrong_s

    def _obey(self, data):
        for frame in self._heard.feed(data):
            if isinstance(frame.message, Command):
                self._obeyed = frame.sequence & 0xFF


@pytest.mark.parametrize("lag_s", [0.1, 0.2, 0.4, 2.0])
def test_a_lag_that_begins_shows_in_the_ages_and_goes_on_showing(lag_s):
    line = Line()
    line.ages(5.0)
    line.down_s = lag_s
    line.ages(lag_s + 0.2)
    # a sample may look fresher than it is by the time between two commands and the way up
    assert min(line.ages(5.0)) >= -(0.05 + WAY_UP_S + 2 * STEP_S)


def test_when_the_lag_is_over_ages_are_small_again():
    line = Line()
    line.ages(3.0)
    line.down_s = 0.3
    line.ages(2.0)
    line.down_s = 0.001
    assert max(line.ages(2.5)) <= 0.04
    assert max(map(abs, line.ages(2.0))) <= 0.004


@pytest.mark.parametrize("up_s", [0.001, 0.005, 0.018])
def test_an_even_line_is_judged_by_the_clock_alone(up_s):
    line = Line(up_s)
    assert max(map(abs, line.ages(20.0))) <= 0.004


def test_one_command_that_is_lost_makes_no_sample_stale():
    line = Line()
    line.ages(1.0)
    assert max(line.ages(1.0, lost=range(600, 630))) <= 0.1


def test_a_board_that_never_echoes_is_not_believed_and_costs_no_memory():
    echo = CommandEcho()
    for n in range(1000):
        echo.sent(2 * n + 1, n * 0.05)
    assert echo.latest_s(0) < 1000 * 0.05 - 5.0
    assert echo.latest_s(1999 & 0xFF) == float("inf")
