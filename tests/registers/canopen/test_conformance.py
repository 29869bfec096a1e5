"""Tests that send the requests of all cases to a CANopen node without I/O, and check the responses."""

import pytest

from tests.registers.canopen.cases import DYNAMIC_CASES, STATIC_CASES
from tests.registers.canopen.fake_master import FakeMaster, format_frames, frames_match

CASES = STATIC_CASES + DYNAMIC_CASES


@pytest.mark.parametrize(("_name", "state", "steps"), CASES, ids=[case[0] for case in CASES])
def test_the_responses_are_those_of_the_case(_name, state, steps):
    master = FakeMaster(state)
    for step, expected in steps:
        frames = master.send(step)
        assert frames_match(expected, frames), (
            f"{step}: {format_frames(frames) or 'no frame'}, expected {expected or 'no frame'}"
        )


def test_no_case_is_listed_twice():
    assert len({(state, str(steps)) for _, state, steps in CASES}) == len(CASES)
