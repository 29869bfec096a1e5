"""Recordings made by hand: columns as a CSV file would give them."""

import pytest

from instrument.columns import points_in
from instrument.errors import ConfigurationError


def csv_of(**columns):
    rows = zip(*columns.values(), strict=True)
    return "\n".join(
        [",".join(columns), *(",".join(f"{float(v):.9g}" for v in row) for row in rows)]
    ).encode()


def points(**columns):
    return points_in(csv_of(**columns), "mine.csv", [tuple(columns)])


def refusal_of(act, *arguments):
    with pytest.raises(ConfigurationError) as told:
        act(*arguments)
    return str(told.value)


def share_within(errors, stds, multiple=1.0):
    """How often an error is within so many of its stated standard uncertainties."""
    return sum(abs(e) <= multiple * s for e, s in zip(errors, stds, strict=True)) / len(errors)
