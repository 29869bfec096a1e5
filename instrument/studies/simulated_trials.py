"""Trials of a simulated scenario, in the form of a recording with a reference force."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.instrument.validation.trial import Trial, TrialSample, split_trials
from pneuforce.sim.headless import Playback
from pneuforce.sim.rig import STEP_S
from pneuforce.sim.scenario import Scenario

#: Function that receives the progress of a simulation: completed amount and total amount.
ProgressCallback = Callable[[float, float], None]
SAMPLES_PER_REPORT = 500


class SimulatedTrials(NamedTuple):
    """Trials of a scenario. `completed` is True if the simulation reached the end of the scenario."""

    trials: tuple[Trial, ...]
    completed: bool


def simulate_trials(scenario: Scenario, report_progress: ProgressCallback) -> SimulatedTrials:
    """Simulate the scenario and return its trials.

    `report_progress` is called while the table of a new membrane is computed, and then once per
    `SAMPLES_PER_REPORT` samples.
    """
    playback = Playback(scenario, report_progress)
    trials = split_trials(_samples(playback, report_progress))
    return SimulatedTrials(trials, playback.finished)


def _samples(playback: Playback, report_progress: ProgressCallback) -> Iterator[TrialSample]:
    for number, (measurement, truth) in enumerate(measure_playback(playback, ChainSettings())):
        if number % SAMPLES_PER_REPORT == 0:
            report_progress(number * STEP_S, playback.expected_s)
        locked = math.isfinite(measurement.baseline_kpa)
        yield TrialSample(truth.t_s, measurement.unfiltered_kpa, truth.force_n, "locked" if locked else None)
