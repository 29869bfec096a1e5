"""Tests that each attack still works and finds nothing in a small amount of input with a fixed seed."""

import pytest

from tests.attack.__main__ import ATTACKS, run

SEED = 1
IN_PROCESSES = ("modbus", "can", "page", "soak")  #: attacks on running processes, in real time


@pytest.mark.parametrize("name", [name for name in ATTACKS if name not in IN_PROCESSES])
def test_an_attack_in_virtual_time_finds_nothing(name):
    result = run(name, SEED, brief=True)
    assert result.sent
    assert not result.findings
