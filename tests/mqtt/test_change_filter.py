"""Tests of the report by exception."""

from pneuforce.mqtt.change_filter import ChangeFilter

FIRST = {"force": 1.0, "pressure": 8.0, "state": "holding", "force_valid": True}


def new_filter():
    changes = ChangeFilter(1.0, {"N": 0.1, "kPa": 0.5})
    assert changes.changes(FIRST, 0.0) == FIRST
    return changes


def test_a_change_within_the_deadband_is_not_published():
    changes = new_filter()
    assert changes.changes(FIRST | {"force": 1.05, "pressure": 8.4}, 5.0) == {}
    assert changes.changes(FIRST | {"force": 1.15, "pressure": 8.4}, 6.0) == {"force": 1.15}


def test_slow_drift_is_published_because_the_deadband_refers_to_the_last_publication():
    changes = new_filter()
    published = [changes.changes(FIRST | {"force": 1.0 + i * 0.04}, 2.0 + i * 2) for i in range(9)]
    assert [each["force"] for each in published if each] == [1.12, 1.24]


def test_measured_values_wait_for_the_end_of_the_period():
    changes = new_filter()
    assert changes.changes(FIRST | {"force": 2.0}, 0.5) == {}
    assert changes.changes(FIRST | {"force": 2.5}, 1.0) == {"force": 2.5}


def test_a_new_state_is_published_at_once_with_the_present_force():
    changes = new_filter()
    assert changes.changes(FIRST | {"force": 2.0, "state": "tripped"}, 0.1) == {
        "force": 2.0,
        "state": "tripped",
    }


def test_the_loss_and_the_return_of_a_force_are_published_at_once():
    changes = new_filter()
    assert changes.changes(FIRST | {"force": None, "force_valid": False}, 0.1) == {
        "force": None,
        "force_valid": False,
    }
    assert changes.changes(FIRST, 0.2) == {"force": 1.0, "force_valid": True}


def test_everything_is_published_again_after_a_restart():
    changes = new_filter()
    changes.restart({})
    assert changes.changes(FIRST, 0.1) == FIRST
