"""Fixtures for the tests of the Structured Text library."""

import pytest

from tests.registers.views.structured_text import blocks as ways
from tests.registers.views.structured_text.compiled import MARKS, library


@pytest.fixture(scope="session", params=["translated", pytest.param("matiec", marks=MARKS)])
def blocks(request):
    """Run the blocks in one way, and then in the other, if the compiler is installed.

    Parse or compile the library before the time limit of the first test starts.
    """
    {"translated": ways.translated_text, "matiec": library}[request.param]()
    ways.selected.append(request.param)
    yield
    ways.selected.pop()
