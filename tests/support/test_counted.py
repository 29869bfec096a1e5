"""Tests of numbers of things in messages."""

import pytest

from pneuforce.support.counted import counted


@pytest.mark.parametrize(
    ("count", "nouns", "expected"),
    [
        (0, ["contact"], "0 contacts"),
        (1, ["contact"], "1 contact"),
        (2, ["more contact"], "2 more contacts"),
        (1, ["sample is", "samples are"], "1 sample is"),
        (5, ["sample is", "samples are"], "5 samples are"),
    ],
)
def test_the_noun_agrees_with_the_number(count, nouns, expected):
    assert counted(count, *nouns) == expected
