"""Known results of the force law."""

import pytest

from pneuforce.instrument.model import METHODS, known_results


@pytest.mark.parametrize("method", METHODS)
def test_this_computer_computes_the_known_forces(method):
    assert known_results.computes_known_forces(method)


@pytest.mark.parametrize("position", range(3))
def test_one_wrong_force_is_found(monkeypatch, position):
    known = list(known_results.KNOWN_N["energetic"])
    known[position] += 1e-6
    monkeypatch.setitem(known_results.KNOWN_N, "energetic", tuple(known))
    assert not known_results.computes_known_forces("energetic")
