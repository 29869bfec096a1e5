"""Tests of a peer that forbids proof tests and disappears."""

import pytest

from pneuforce.instrument.core.proof_test_schedule import FIRST_S, MAX_FORBIDDEN_PERIODS
from tests.instrument.instrument_harness import FORCE_LIMIT, ROBOT, InstrumentHarness

PERIOD_S = 0.8
FORBIDDEN_S = MAX_FORBIDDEN_PERIODS * PERIOD_S  #: longer than the time until the first test
FORBID = {"proof_test": "forbidden"}


@pytest.fixture
def holding():
    harness = InstrumentHarness.holding(proof_test_s=PERIOD_S)
    harness.write_ok(FORBID, ROBOT)
    return harness


def value_of(harness):
    return harness.snapshot(ROBOT).proof_test


def test_the_tests_are_allowed_again_if_the_peer_has_written_nothing_for_twenty_periods(holding):
    assert FIRST_S < FORBIDDEN_S
    holding.run(FORBIDDEN_S - 0.1)
    assert (value_of(holding), holding.instrument.proof_tests.count) == ("forbidden", 0)
    holding.run(0.3)
    assert (value_of(holding), holding.instrument.proof_tests.count) == ("allowed", 1)


def test_each_write_of_the_peer_keeps_the_tests_forbidden(holding):
    for _ in range(3):
        holding.run(FORBIDDEN_S / 2)
        holding.write_ok(FORCE_LIMIT, ROBOT)
    assert (value_of(holding), holding.instrument.proof_tests.count) == ("forbidden", 0)


def test_writes_of_another_peer_do_not_keep_the_tests_forbidden(holding):
    holding.renew(FORBIDDEN_S + 0.3)
    assert value_of(holding) == "allowed"
    assert holding.instrument.proof_tests.count > 0


def test_without_proof_tests_the_value_does_not_expire():
    harness = InstrumentHarness.zeroed(proof_test_s=0.0)
    harness.write_ok(FORBID, ROBOT)
    harness.run(2.0)
    assert value_of(harness) == "forbidden"
