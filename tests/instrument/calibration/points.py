"""Helpers for calibration tests: columns of numbers as a CSV file, error messages, statistics of errors."""

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.support.columns import parse_points


def csv_of(**columns):
    rows = zip(*columns.values(), strict=True)
    return "\n".join(
        [",".join(columns), *(",".join(f"{float(v):.9g}" for v in row) for row in rows)]
    ).encode()


def points(**columns):
    return parse_points(csv_of(**columns), "mine.csv", [tuple(columns)])


def error_message(function, *arguments):
    """Return the message of the ConfigurationError that the function raises."""
    with pytest.raises(ConfigurationError) as raised:
        function(*arguments)
    return str(raised.value)


def share_within(errors, stds, multiple=1.0):
    """Return the share of errors that are at most `multiple` times their standard uncertainty."""
    return sum(abs(e) <= multiple * s for e, s in zip(errors, stds, strict=True)) / len(errors)
