"""Detection of a clipped pressure: the pressure is constant while the reference force changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneuforce.instrument.validation.trial import Bools, Floats, Trial

#: Consecutive samples with the highest pressure of a recording. An unclipped peak with noise has fewer.
MIN_CLIPPED_SAMPLES = 5
#: Change of the reference force during these samples, relative to its maximum. During an unclipped plateau,
#: the force changes less.
MIN_FORCE_CHANGE = 0.1


def clipping_remark(trials: Sequence[Trial]) -> str:
    """Return a remark with the number of clipped samples, "" if no pressure is clipped."""
    highest_kpa = max(float(trial.pressure_kpa.max()) for trial in trials)
    at_limit = [trial.pressure_kpa == highest_kpa for trial in trials]
    if not any(
        _force_changes(trial.force_n, highest) for trial, highest in zip(trials, at_limit, strict=True)
    ):
        return ""
    count = sum(int(highest.sum()) for highest in at_limit)
    return (
        f"the pressure of {count} samples is clipped at {highest_kpa:g} kPa, because the reference force "
        "changes while the pressure is constant. The forces of these samples are too low: use a pressure "
        "sensor with a larger range, or press less"
    )


def _force_changes(force_n: Floats, selected: Bools) -> bool:
    """Return True if the force changes during a sufficient number of consecutive selected samples."""
    positions = np.flatnonzero(selected)
    runs = np.split(force_n[positions], np.flatnonzero(np.diff(positions) > 1) + 1)
    return any(
        len(run) >= MIN_CLIPPED_SAMPLES and np.ptp(run) > MIN_FORCE_CHANGE * run.max() > 0 for run in runs
    )
