"""Tests that each attack on running processes still works and finds nothing."""

import pytest

from tests.attack.__main__ import run
from tests.attack.test_attack import IN_PROCESSES, SEED


@pytest.mark.parametrize("name", IN_PROCESSES)
def test_an_attack_on_processes_finds_nothing(name):
    result = run(name, SEED, brief=True)
    assert result.sent
    assert not result.findings
