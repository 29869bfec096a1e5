"""Tests of the selection of contacts for the bars by pressure."""

import pytest

from pneuforce.instrument.recording.contacts import ContactRow
from pneuforce.instrument.validation.by_pressure import evaluable

COMPLETE = ContactRow(1, 1.0, 8.0, 0.9, 9.5, 1.5, 20.0, 1.2, 0.1, 0.4, 1, 1.0, open=False, cut=False)


@pytest.mark.parametrize("change", [{"open": True}, {"cut": True}, {"peak_n": 0.0}, {"final_kpa": 8.4}])
def test_only_complete_contacts_with_a_force_and_a_rise_are_evaluated(change):
    assert evaluable([COMPLETE, COMPLETE._replace(**change)]) == [COMPLETE]
