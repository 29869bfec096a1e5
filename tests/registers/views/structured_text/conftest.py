"""Fixtures for the tests of the Structured Text library."""

import pytest

from tests.registers.views.structured_text.compiled import library


@pytest.fixture(scope="session")
def blocks():
    """Compile the library before the time limit of the first test starts."""
    return library()
