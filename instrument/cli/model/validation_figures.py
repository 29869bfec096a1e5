"""Figures of `pneuforce validate`: selects or simulates the trials of each figure, and draws the figures."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean

import numpy as np

from pneuforce.instrument.cli.model.validation_source import (
    DEFAULT_SCENARIO,
    SourceOptions,
    selected_scenario,
    simulate_source,
)
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.validation import figures, paper
from pneuforce.instrument.validation.law_figure import draw_law
from pneuforce.instrument.validation.peaks import PeakForces
from pneuforce.instrument.validation.report import TrialEvaluation, evaluate_trials
from pneuforce.sim.factory import build_plant

FAST_SCENARIO = "fast"  #: scenario of Figs. 6b and 6c of the paper
#: Fig. 6a shows the trial whose mean ΔP_i is nearest to this pressure.
SHOWN_BASELINE_KPA = 8.0
FIG4_PRESSURES_KPA = np.linspace(0.5, 12.0, 22)  #: the paper measured 22 pressures for Fig. 4


def draw_figures(
    folder: Path,
    options: SourceOptions,
    trials: list[TrialEvaluation],
    peaks: PeakForces,
    settings: ChainSettings,
) -> None:
    """Draw Figs. 6a, 6c and 7 and the variants of the law. On the simulated rig, draw Figs. 4 and 6b too."""
    slow = fast = min((trial for trial in trials if trial.evaluable_contacts), key=_distance_kpa)
    if options.data is None:
        [fast, *_] = evaluate_trials(simulate_source(options, FAST_SCENARIO).trials, settings)
        plant = build_plant(selected_scenario(options, options.scenario or DEFAULT_SCENARIO).plant)
        radius_mm = np.array([plant.radius_mm(pressure_kpa) for pressure_kpa in FIG4_PRESSURES_KPA])
        fig4 = figures.draw_radius(FIG4_PRESSURES_KPA, radius_mm, settings)
        figures.save(folder, "fig4-radius", fig4)
        fig6b = figures.draw_contacts(fast, settings, "fast contacts", paper.FAST_PERCENT)
        figures.save(folder, "fig6b-fast", fig6b)
    fig6a = figures.draw_contacts(slow, settings, "slow contacts", paper.SLOW_PERCENT)
    figures.save(folder, "fig6a-slow", fig6a)
    figures.save(folder, "fig6c-continuous", figures.draw_continuous(fast))
    figures.save(folder, "fig7-errors", figures.draw_error_bars(peaks, settings))
    figures.save(folder, "law", draw_law(settings.balloon, settings.circuit))


def _distance_kpa(trial: TrialEvaluation) -> float:
    """Return the distance of the mean ΔP_i of a trial from `SHOWN_BASELINE_KPA`."""
    mean_kpa = fmean(contact.baseline_kpa for contact in trial.evaluable_contacts)
    return abs(mean_kpa - SHOWN_BASELINE_KPA)
