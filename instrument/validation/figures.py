"""Figures after the paper's Figs. 4, 6 and 7."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from instrument.chain import ChainSettings
from instrument.errors import ConfigurationError
from instrument.validation.paper import FIFTHS
from instrument.validation.peaks import Peaks, errors_of, peaks_of
from instrument.validation.report import Seen
from instrument.validation.trial import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("png", "svg")
DOTS_PER_INCH = 90
SIZE_INCH = (7.0, 4.2)
SHOWN_S, DRAWN_PER_S = 40.0, 50.0  #: the part of a trial that is drawn, and how finely
LEAD_S = 3.0
STIFF_FIFTHS = 2  #: the paper sets off the last two fifths of the range
DASH_S = 0.5  #: length of the dash that shows an estimate
BLUE, GREEN, RED, YELLOW, GREY = "#1f4e9c", "#2e8b57", "#c8102e", "#f2b705", "#666666"


def check_drawable(wish: str) -> None:
    """Raises ConfigurationError where nothing can be drawn."""
    if find_spec("matplotlib") is None:
        raise ConfigurationError(f"{wish} needs matplotlib: {sys.executable} -m pip install matplotlib")


def prepared(folder: Path) -> None:
    """Make the folder. Raises ConfigurationError where that, or drawing, is not possible."""
    check_drawable("--figures")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigurationError(f"{folder}: cannot be a folder: {error.strerror}") from None


def save(folder: Path, name: str, figure: Figure) -> None:
    """Write a figure in every format. Raises ConfigurationError."""
    for form in FORMATS:
        try:
            figure.savefig(folder / f"{name}.{form}", dpi=DOTS_PER_INCH)
        except OSError as error:
            raise ConfigurationError(f"{folder / name}.{form}: cannot be written: {error.strerror}") from None


def radius(pressure_kpa: Floats, radius_mm: Floats, settings: ChainSettings) -> Figure:
    """Fig. 4: the balloon's radius by pressure, and what the instrument believes."""
    figure, [axes] = _figure(1)
    axes.plot(pressure_kpa, radius_mm, "o", color=BLUE, markersize=5, label="simulated balloon")
    believed_mm = settings.balloon.radius_mm(pressure_kpa)
    axes.plot(
        pressure_kpa, believed_mm, color=RED, label="the instrument's quadratic, as measured in the paper"
    )
    axes.set(xlabel="inflating pressure ΔP_i [kPa]", ylabel="radius R_i [mm]")
    axes.legend(frameon=False)
    return figure


def contacts(trial: Seen, settings: ChainSettings, title: str, printed_percent: float) -> Figure:
    """Figs. 6a and 6b: ΔP_i and ΔP_f on the pressure, the estimates as dashes on the reference force."""
    figure, [above, below] = _figure(2)
    course, begin_s = trial.course, _begin_s(trial)
    t_s = course.trial.t_s - begin_s
    _line(above, t_s, course.filtered_kpa, BLUE)
    _line(below, t_s, course.filtered_n, GREEN, label="reference")
    drawn = [contact for contact in trial.appreciable if contact.final_s - begin_s < SHOWN_S]
    initial, final, true, low_s, high_s = np.array(drawn).T
    peaks = peaks_of(initial, final, true, settings)
    above.plot(low_s - begin_s, initial, "*", color=YELLOW, markeredgecolor=GREY, markersize=9, label="ΔP_i")
    above.plot(high_s - begin_s, final, "*", color=RED, markersize=9, label="ΔP_f")
    at_s, estimate_n = high_s - begin_s, peaks.estimates_n["energetic"]
    below.hlines(estimate_n, at_s - DASH_S, at_s + DASH_S, RED, "dashed", label="estimated peak")
    above.set(ylabel="pressure [kPa]")
    mean = f"{_mean_percent(peaks):.2f} % (the paper's: {printed_percent} %)"
    above.set_title(f"{title}: mean error {mean}", loc="left", fontsize=10)
    below.set(ylabel="force [N]", xlabel="time [s]")
    _legends(above, below)
    return figure


def continuous(trial: Seen) -> Figure:
    """Fig. 6c: the force while it changes, beside the reference; nothing is shifted."""
    figure, [above, below] = _figure(2)
    course, forces, t_s = trial.course, trial.forces, trial.course.trial.t_s - _begin_s(trial)
    _line(above, t_s, course.trial.pressure_kpa, GREY, label="as read")
    _line(above, t_s, course.filtered_kpa, BLUE, label="filtered")
    _line(below, t_s, course.trial.force_n, GREEN, label="reference", width=3.5)
    _line(below, t_s, forces.compensated_n, RED, label="lag compensated")
    _line(below, t_s, forces.uncompensated_n, GREY, label="from the filtered pressure")
    above.set(ylabel="pressure [kPa]")
    above.set_title("continuous force, nothing shifted", loc="left", fontsize=10)
    below.set(ylabel="force [N]", xlabel="time [s]")
    for axes in (above, below):
        axes.set_xlim(0, SHOWN_S / 4)
    _legends(above, below)
    return figure


def error_bars(peaks: Peaks) -> Figure:
    """Fig. 7: mean absolute error by fifths of the range."""
    groups = errors_of(peaks, FIFTHS)
    names = [f"{group.name}\nn = {group.contacts}" for group in groups]
    heights = [group.by_method["energetic"].absolute_percent for group in groups]
    figure = fifth_bars(names, heights, "inflating pressure ΔP_i", "mean absolute error [%]")
    figure.axes[0].tick_params(axis="x", labelsize=8)
    return figure


def fifth_bars(names: Sequence[str], percent: Sequence[float], what: str, how_much: str) -> Figure:
    """A bar for each fifth of the range, a dash where it is NaN; energy (4) in another colour than (5)."""
    figure, [axes] = _figure(1)
    colours = [YELLOW] * (len(names) - STIFF_FIFTHS) + [BLUE] * STIFF_FIFTHS
    bars = axes.bar(names, np.nan_to_num(percent), color=colours, edgecolor=GREY)
    axes.bar_label(bars, ["–" if np.isnan(height) else f"{height:.2f}" for height in percent], padding=2)
    axes.set(xlabel=what, ylabel=how_much)
    return figure


def _figure(rows: int) -> tuple[Figure, list[Axes]]:
    """An empty figure with plots one above the other that share their time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_INCH, layout="constrained")
    axes = np.ravel(figure.subplots(rows, sharex=True)).tolist()
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
        one.grid(alpha=0.25)
        one.set_axisbelow(True)
    return figure, axes


def _line(
    axes: Axes, t_s: Floats, values: Floats, colour: str, label: str | None = None, width: float = 1.2
) -> None:
    """What is shown of a trial, thinned out."""
    every = max(round(1 / (DRAWN_PER_S * float(np.median(np.diff(t_s))))), 1)
    at_s = t_s[::every]
    shown = (at_s >= 0) & (at_s < SHOWN_S)
    axes.plot(at_s[shown], values[::every][shown], color=colour, linewidth=width, label=label)


def _begin_s(trial: Seen) -> float:
    """Time [s] at which a drawing begins: some seconds before the first contact."""
    first_s = float(trial.course.trial.t_s[0])
    return max([first_s, *(contact.final_s - LEAD_S for contact in trial.appreciable[:1])])


def _legends(*plots: Axes) -> None:
    for axes in plots:
        axes.legend(frameon=False, ncols=3, fontsize=8, loc="lower right", bbox_to_anchor=(1, 1))


def _mean_percent(peaks: Peaks) -> float:
    return float(np.nanmean(np.abs(peaks.errors_percent("energetic"))))
