"""Tests of the words of requests: a rejection names its true cause, and a clear warns of a failed vent."""

from types import SimpleNamespace

import pytest

from pneuforce.client.details import Details
from pneuforce.client.measurement import State
from pneuforce.client.rejection import rejected
from pneuforce.errors import Rejected
from pneuforce.instrument.cli.operate.requests import _clear, explained, make_zero_adjustment


class Sensor:
    """Instrument that rejects a zero adjustment for a reason."""

    url = "tcp://127.0.0.1:5020?unit=1"

    def __init__(self, reason="none", state=State.VENTED, **details):
        self._reason, self._state, self._details = reason, state, Details(**details)

    def zero(self):
        raise rejected("zero_pressure", self._reason)

    def clear(self):
        pass

    def read(self):
        return SimpleNamespace(state=self._state)

    def details(self):
        return self._details


@pytest.mark.parametrize(
    ("details", "cause", "other"),
    [
        ({"lease_holder": "can", "lease_left_s": 1.0}, "client of can", "lease_required"),
        ({"lease_holder": "none"}, "lease_required", "client of"),
    ],
)
def test_a_rejection_because_of_a_lease_names_only_the_true_cause(details, cause, other):
    with pytest.raises(Rejected) as caught:
        explained(Sensor("lease", **details), make_zero_adjustment)
    assert caught.value.reason == "lease"
    assert cause in caught.value.remedy
    assert other not in caught.value.remedy


def test_a_zero_adjustment_in_a_contact_needs_its_end_and_a_vent():
    with pytest.raises(Rejected, match=r"End the contact.*pneuforce vent"):
        explained(Sensor("in_contact"), make_zero_adjustment)


def test_after_a_failed_vent_a_clear_warns_of_an_inflated_balloon():
    assert "INFLATED" in _clear(Sensor(), ["lease_expired", "occlusion"])
    assert "INFLATED" not in _clear(Sensor(), ["lease_expired"])
    assert _clear(Sensor(state=State.HOLDING), []).endswith("The balloon is inflated")
    assert "INFLATED" in _clear(Sensor(maintenance_causes=frozenset({"tube_unproven"})), [])
