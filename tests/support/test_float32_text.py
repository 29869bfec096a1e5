"""Tests of the text of 32-bit numbers."""

import math
import struct

import pytest

from pneuforce.support.float32_text import float32_text
from pneuforce.support.rejected_write import describe_quantity


@pytest.mark.parametrize("value", [5.1, 0.1, 12.05, 16777216.0, 1e-7, 8.0, -2.5, 101.325, 12.0000010, 1 / 3])
def test_the_text_is_short_and_is_the_same_number(value):
    (received,) = struct.unpack("f", struct.pack("f", value))
    text = float32_text(received)
    assert struct.pack("f", float(text)) == struct.pack("f", value)
    assert len(text) <= len(f"{value:.9g}")


@pytest.mark.parametrize(("value", "text"), [(math.nan, "nan"), (math.inf, "inf"), (1e300, "1e+300")])
def test_a_value_that_is_no_finite_32_bit_number_has_a_text(value, text):
    assert float32_text(value) == text


def test_a_written_force_limit_has_the_digits_that_the_user_wrote():
    (received,) = struct.unpack("f", struct.pack("f", 5.1))
    assert describe_quantity("force_limit_n", received) == "force_limit 5.1 N"
