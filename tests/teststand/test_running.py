"""Tests of the arguments of `simulated_rig`. The tests in tests/client/ start it."""

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.teststand.running import instrument_tables


def test_tables_of_the_configuration_are_accepted():
    assert instrument_tables({}) == {}
    assert instrument_tables({"safety": {"force_limit_n": 2.0}}) == {"safety": {"force_limit_n": 2.0}}


@pytest.mark.parametrize("invalid", [5, "safety", {"safety": 2.0}, [("safety", {})]])
def test_other_values_are_rejected_with_an_example(invalid):
    with pytest.raises(ConfigurationError, match=r"must contain tables .* \{\"safety\""):
        instrument_tables(invalid)
