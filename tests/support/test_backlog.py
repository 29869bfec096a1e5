"""Tests of the detection of data that waited in a buffer, in virtual time."""

import pytest

from pneuforce.support.backlog import MAX_GAP_S, RECEIVE_TIMEOUT_S, SETTLED_S, Backlog


def run(backlog, now_s, steps):
    """Add receptions: (time since the last [s], whether data arrived). Return the time and the answers."""
    seen = []
    for step_s, arrived in steps:
        now_s += step_s
        backlog.add(now_s, arrived=arrived)
        seen.append(backlog.possible)
    return now_s, seen


def test_data_and_timeouts_in_time_are_current():
    backlog = Backlog()
    steps = [(1000.0, True), *[(0.01, True)] * 20, (RECEIVE_TIMEOUT_S, False), (RECEIVE_TIMEOUT_S, False)]
    assert not any(run(backlog, 0.0, steps)[1])
    assert backlog.timeout_s == RECEIVE_TIMEOUT_S


@pytest.mark.parametrize("waiting", [1, 1000])
def test_after_a_stop_all_data_is_possibly_old_until_nothing_has_waited_for_a_time(waiting):
    backlog = Backlog()
    now_s, _ = run(backlog, 0.0, [(0.0, True)])
    now_s, seen = run(backlog, now_s, [(3.0, True), *[(1e-5, True)] * waiting])
    assert all(seen)
    assert backlog.timeout_s == 0.0  # shows whether something waits
    now_s, seen = run(backlog, now_s, [(1e-5, False), (SETTLED_S / 2, True), (1e-5, False)])
    assert all(seen)  # the sender could have waited, too
    _, seen = run(backlog, now_s, [(SETTLED_S / 2, True), (1e-5, False), (0.01, True)])
    assert seen == [True, False, False]
    assert backlog.timeout_s == RECEIVE_TIMEOUT_S


def test_a_second_stop_begins_again():
    backlog = Backlog()
    now_s, _ = run(backlog, 0.0, [(0.0, True), (3.0, True), (1e-5, False)])
    now_s, seen = run(backlog, now_s, [(MAX_GAP_S + 0.01, False), (SETTLED_S / 2, False)])
    assert all(seen)
    assert not run(backlog, now_s, [(SETTLED_S, False)])[1][0]


def test_the_thread_pauses_only_while_it_looks_for_old_data():
    backlog = Backlog()
    assert backlog.add(0.0, arrived=False) == 0.0
    assert backlog.add(1.0, arrived=True) == 0.0
    assert 0.0 < backlog.add(1.001, arrived=False) < SETTLED_S
    assert backlog.add(1.06, arrived=False) == 0.0
