"""Points that are given as command line options instead of a CSV file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pneuforce.errors import ConfigurationError
from pneuforce.support.columns import MAX_MAGNITUDE, Points


def points_from_options(columns: Mapping[str, Sequence[float]], point_name: str) -> Points:
    """Return the points. Each column is an option that was given once for each point.

    `point_name` is the name of a point in messages. The name of the result consists of the options. Raises
    ConfigurationError if the columns differ in length, or if a value is not a usable number.
    """
    *first, last = (f"--{name.replace('_', '-')}" for name in columns)
    options, lengths = f"{', '.join(first)} and {last}", {len(values) for values in columns.values()}
    if len(lengths) > 1:
        raise ConfigurationError(f"{options}: give each option once for every {point_name}")
    arrays = {name: np.array(values, float) for name, values in columns.items()}
    if not all((np.abs(values) <= MAX_MAGNITUDE).all() for values in arrays.values()):
        raise ConfigurationError(f"{options} must be numbers up to {MAX_MAGNITUDE:g}")
    return Points(_words(columns), "", arrays, tuple(range(1, lengths.pop() + 1)))


def _words(columns: Mapping[str, Sequence[float]]) -> str:
    """Return the options as a user typed them. They are the source of a part of a calibration file."""
    names = [f"--{name.replace('_', '-')}" for name in columns]
    points = zip(*columns.values(), strict=True)
    return " ".join(
        f"{name} {value:.10g}" for point in points for name, value in zip(names, point, strict=True)
    )
