"""Fixtures of the tests of the instrument."""

import pytest

from tests.instrument.fake_board import FakeCable


@pytest.fixture
def cable(tmp_path):
    """Return a cable without a board. Its boards end with the test."""
    cable = FakeCable(tmp_path / "rig")
    yield cable
    for board in cable.boards:
        board.end()
