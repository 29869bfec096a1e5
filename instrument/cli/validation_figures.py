"""The figures of a validation: which trials are drawn, and what is simulated for them."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean

import numpy as np

from instrument.chain import ChainSettings
from instrument.cli.validation_source import CAMPAIGN, Choice, simulated, staged
from instrument.validation import figures, paper
from instrument.validation.law_figure import law
from instrument.validation.peaks import Peaks
from instrument.validation.report import Seen, seen
from sim.staging import plant_of

QUICK = "fast"  #: the scenario of Figs. 6b and 6c
USUAL_KPA = 8.0  #: the slow trial that is drawn is the one nearest to this
MEASURED_KPA = np.linspace(0.5, 12.0, 22)  #: as many pressures as the paper measured for Fig. 4


def draw(folder: Path, choice: Choice, trials: list[Seen], peaks: Peaks, settings: ChainSettings) -> None:
    """Draw Figs. 6a, 6c and 7 and the law's choices, and Figs. 4 and 6b where the rig is simulated."""
    slow = quick = min((trial for trial in trials if trial.appreciable), key=_from_usual_kpa)
    if choice.data is None:
        [quick, *_] = seen(simulated(choice, QUICK).trials, settings)
        plant = plant_of(staged(choice, choice.scenario or CAMPAIGN).plant)
        radius_mm = np.array([plant.radius_mm(pressure_kpa) for pressure_kpa in MEASURED_KPA])
        figures.save(folder, "fig4-radius", figures.radius(MEASURED_KPA, radius_mm, settings))
        figures.save(
            folder, "fig6b-fast", figures.contacts(quick, settings, "fast contacts", paper.FAST_PERCENT)
        )
    figures.save(folder, "fig6a-slow", figures.contacts(slow, settings, "slow contacts", paper.SLOW_PERCENT))
    figures.save(folder, "fig6c-continuous", figures.continuous(quick))
    figures.save(folder, "fig7-errors", figures.error_bars(peaks))
    figures.save(folder, "law", law(settings.balloon, settings.circuit))


def _from_usual_kpa(trial: Seen) -> float:
    return abs(fmean(contact.initial_kpa for contact in trial.appreciable) - USUAL_KPA)
