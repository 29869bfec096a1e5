"""The cases, played to the slave without I/O."""

import pytest

from tests.registers.canopen.cases import MOVING, STANDING
from tests.registers.canopen.talking import Master, agrees, told

CASES = STANDING + MOVING


@pytest.mark.parametrize(("_name", "state", "steps"), CASES, ids=[case[0] for case in CASES])
def test_what_comes_back_is_what_the_case_says(_name, state, steps):
    master = Master(state)
    for said, expected in steps:
        frames = master.say(said)
        assert agrees(expected, frames), f"{said}: {told(frames) or 'silence'}, not {expected or 'silence'}"


def test_no_case_is_there_twice():
    assert len({(state, str(steps)) for _, state, steps in CASES}) == len(CASES)
