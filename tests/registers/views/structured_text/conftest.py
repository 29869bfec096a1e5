import pytest

from tests.registers.views.structured_text.compiled import library


@pytest.fixture(scope="session")
def blocks():
    """Compiled before a test is timed."""
    return library()
