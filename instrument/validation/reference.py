"""A reference force beside recorded pressures: what makes them a recording that can be validated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from instrument import whole_file
from instrument.columns import Numbers, Points, points_in
from instrument.errors import ConfigurationError
from instrument.validation.recording import NEEDED

ROWS_AT_ONCE = 5000
MOST_APART_S = 0.15  #: two points of the reference; a logger of 10 Hz may be late by half


class Pressure(NamedTuple):
    """One sample without a reference."""

    t_s: float
    pressure_kpa: float  #: gauge, zeroed; NaN where the sensor is not believed
    locked: bool  #: whether the balloon is locked


def read(path: Path) -> Points:
    """A reference force over time, columns t_s and force_n. Raises ConfigurationError."""
    points = points_in(whole_file.content_of(path), str(path), [("t_s", "force_n")])
    points.at_least(2)
    still = np.flatnonzero(~(np.diff(points["t_s"]) > 0.0))
    if len(still):
        raise points.refusal("t_s: time must rise", int(still[0]) + 1)
    return points


def beside(samples: Iterable[Pressure], reference: Points) -> Iterator[str]:
    """Lines of a recording: the samples that the reference covers, each with its force, phase by phase.

    Between two points of the reference the force is on the line, unless they are too far apart. Raises
    ConfigurationError where not a single sample is covered.
    """
    yield ",".join([*NEEDED, "phase"]) + "\n"
    rows, before_s = 0, -np.inf
    numbered = _phases(samples)
    while batch := list(islice(numbered, ROWS_AT_ONCE)):
        t_s = np.array([sample.t_s for sample, _ in batch])
        force_n = force_at(t_s, reference)
        for (sample, phase), force in zip(batch, force_n.tolist(), strict=True):
            if force == force and sample.pressure_kpa == sample.pressure_kpa and sample.t_s > before_s:
                before_s, rows = sample.t_s, rows + 1
                yield f"{sample.t_s:.6f},{sample.pressure_kpa:.5f},{force:.5f},{phase}\n"
    if not rows:
        low_s, high_s = reference["t_s"][[0, -1]]
        raise ConfigurationError(
            f"{reference.name}: from {low_s:g} s to {high_s:g} s it covers no sample: "
            "its t_s must count from the beginning of the recording"
        )


def force_at(t_s: Numbers, reference: Points) -> Numbers:
    """The reference force [N] at these times; NaN where its points are too far apart, or there are none."""
    known_s = reference["t_s"]
    after = np.clip(np.searchsorted(known_s, t_s), 1, len(known_s) - 1)
    close = known_s[after] - known_s[after - 1] <= MOST_APART_S
    force_n = np.interp(t_s, known_s, reference["force_n"], left=np.nan, right=np.nan)
    return np.where(close, force_n, np.nan)


def _phases(samples: Iterable[Pressure]) -> Iterator[tuple[Pressure, str]]:
    """Each sample with the number of its lock, empty where the balloon is not locked."""
    number, locked = 0, False
    for sample in samples:
        number += sample.locked and not locked
        locked = sample.locked
        yield sample, str(number) if locked else ""
