"""Figures of a validation, in the style of Figs. 4, 6 and 7 of the paper."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneuforce.errors import ConfigurationError, NotInstalled
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.validation.accuracy import estimate_forces
from pneuforce.instrument.validation.instrument_errors import instrument_errors
from pneuforce.instrument.validation.paper import PRESSURE_BINS
from pneuforce.instrument.validation.peaks import PeakForces
from pneuforce.instrument.validation.report import TrialEvaluation
from pneuforce.instrument.validation.trial import Floats
from pneuforce.support.write_error import write_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("png", "svg")
#: Names of all figures, without the extension.
NAMES = ("fig4-radius", "fig6a-slow", "fig6b-fast", "fig6c-continuous", "fig7-errors", "law")
DOTS_PER_INCH = 90
SIZE_INCH = (7.0, 4.2)
SHOWN_S = 40.0  #: duration of the part of a trial that a figure shows
POINTS_PER_S = 50.0  #: resolution of a curve
LEAD_S = 3.0  #: time before the first contact at which a figure begins
BINS_ABOVE_SWITCH = 2  #: number of bins above `Balloon.switch_kpa`, which the paper highlights
DASH_S = 0.5  #: half length of the dash that shows an estimate
BLUE, GREEN, RED, YELLOW, GREY = "#1f4e9c", "#2e8b57", "#c8102e", "#f2b705", "#666666"


def require_matplotlib(feature: str) -> None:
    """Raise NotInstalled if matplotlib is not installed. The message names `feature`."""
    if find_spec("matplotlib") is None:
        raise NotInstalled(f"{feature} needs matplotlib: {sys.executable} -m pip install matplotlib")


def prepare_folder(folder: Path, overwrite: bool) -> None:
    """Create the folder for the figures.

    Raises ConfigurationError if the folder cannot be created, if matplotlib is not installed, or if a figure
    exists and `overwrite` is False.
    """
    require_matplotlib("--figures")
    files = (folder / f"{name}.{extension}" for name in NAMES for extension in FORMATS)
    existing = [file for file in files if file.exists()]
    if existing and not overwrite:
        raise ConfigurationError(
            f"{existing[0]} exists already: name another folder, or replace the figures with --overwrite"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigurationError(
            f"{folder}: the folder cannot be created: {error.strerror}: name another folder"
        ) from None


def save(folder: Path, name: str, figure: Figure) -> None:
    """Write a figure in every format. Raises ConfigurationError or WriteFailed."""
    for extension in FORMATS:
        path = folder / f"{name}.{extension}"
        try:
            figure.savefig(path, dpi=DOTS_PER_INCH)
        except OSError as error:
            raise write_error(path, error) from None


def draw_radius(pressure_kpa: Floats, radius_mm: Floats, settings: ChainSettings) -> Figure:
    """Return Fig. 4: radius of the simulated balloon over pressure, and the quadratic of the instrument."""
    figure, [axes] = _figure(1)
    axes.plot(pressure_kpa, radius_mm, "o", color=BLUE, markersize=5, label="simulated balloon")
    quadratic_mm = settings.balloon.radius_mm(pressure_kpa)
    axes.plot(
        pressure_kpa, quadratic_mm, color=RED, label="quadratic of the instrument, as measured in the paper"
    )
    axes.set(xlabel="inflating pressure ΔP_i [kPa]", ylabel="radius R_i [mm]")
    axes.legend(frameon=False)
    return figure


def draw_contacts(
    trial: TrialEvaluation, settings: ChainSettings, title: str, published_percent: float
) -> Figure:
    """Return Fig. 6a or 6b: the pressure with ΔP_i and ΔP_f, and the reference force with the estimates."""
    figure, [above, below] = _figure(2)
    processed, begin_s = trial.processed, _begin_s(trial)
    t_s = processed.trial.t_s - begin_s
    _draw_line(above, t_s, processed.filtered_kpa, BLUE)
    _draw_line(below, t_s, processed.filtered_n, GREEN, label="reference")
    shown = [contact for contact in trial.evaluable_contacts if contact.final_s - begin_s < SHOWN_S]
    initial, final, reference_n, initial_s, final_s = np.array([contact[:5] for contact in shown]).T
    estimate_n, _ = estimate_forces(zip(initial, final, strict=True), settings)
    above.plot(
        initial_s - begin_s, initial, "*", color=YELLOW, markeredgecolor=GREY, markersize=9, label="ΔP_i"
    )
    above.plot(final_s - begin_s, final, "*", color=RED, markersize=9, label="ΔP_f")
    at_s = final_s - begin_s
    below.hlines(estimate_n, at_s - DASH_S, at_s + DASH_S, RED, "dashed", label="estimated peak")
    above.set(ylabel="pressure [kPa]")
    mean_percent = 100 * float(np.nanmean(np.abs(estimate_n / reference_n - 1)))
    mean = f"{mean_percent:.2f} % (paper: {published_percent} %)"
    above.set_title(f"{title}{_force_name(settings)}: mean error {mean}", loc="left", fontsize=10)
    below.set(ylabel="force [N]", xlabel="time [s]")
    _add_legends(above, below)
    return figure


def draw_continuous(trial: TrialEvaluation) -> Figure:
    """Return Fig. 6c: the continuous force and the reference force, without a time shift."""
    figure, [above, below] = _figure(2)
    processed, forces = trial.processed, trial.forces
    t_s = processed.trial.t_s - _begin_s(trial)
    _draw_line(above, t_s, processed.trial.pressure_kpa, GREY, label="unfiltered")
    _draw_line(above, t_s, processed.filtered_kpa, BLUE, label="filtered")
    _draw_line(below, t_s, processed.trial.force_n, GREEN, label="reference", width=3.5)
    _draw_line(below, t_s, forces.compensated_n, RED, label="lag compensated")
    _draw_line(below, t_s, forces.uncompensated_n, GREY, label="from the filtered pressure")
    above.set(ylabel="pressure [kPa]")
    above.set_title("continuous force, not shifted", loc="left", fontsize=10)
    below.set(ylabel="force [N]", xlabel="time [s]")
    for axes in (above, below):
        axes.set_xlim(0, SHOWN_S / 4)
    _add_legends(above, below)
    return figure


def draw_error_bars(peaks: PeakForces, settings: ChainSettings) -> Figure:
    """Return Fig. 7: the mean absolute error in each pressure bin, of the force by the law in effect.

    The pressures are filtered, as in the paper.
    """
    bins = instrument_errors(peaks, peaks.filtered, settings, PRESSURE_BINS)
    names = [f"{errors.group}\nn = {errors.contacts}" for errors in bins]
    quantity = f"mean absolute error{_force_name(settings)} [%]"
    figure = pressure_bin_bars(
        names,
        [errors.absolute for errors in bins],
        "inflating pressure ΔP_i",
        quantity,
        two_energies=settings.law.method == "energetic",
    )
    figure.axes[0].tick_params(axis="x", labelsize=8)
    return figure


def _force_name(settings: ChainSettings) -> str:
    """Return the force for a label, "" for the energetic method without a force calibration."""
    if settings.correction is not None:
        return ", calibrated"
    return "" if settings.law.method == "energetic" else f", {settings.law.method}"


def pressure_bin_bars(
    names: Sequence[str], percent: Sequence[float], x_label: str, y_label: str, *, two_energies: bool
) -> Figure:
    """Return a figure with a bar for each pressure bin. A value of NaN is shown as a dash.

    With `two_energies`, the bins above 8.85 kPa have a different colour, because the energetic method uses
    stretching energy (4) there.
    """
    figure, [axes] = _figure(1)
    low_bins = len(names) - BINS_ABOVE_SWITCH if two_energies else 0
    colours = [YELLOW] * low_bins + [BLUE] * (len(names) - low_bins)
    bars = axes.bar(names, np.nan_to_num(percent), color=colours, edgecolor=GREY)
    axes.bar_label(bars, ["–" if np.isnan(height) else f"{height:.2f}" for height in percent], padding=2)
    axes.set(xlabel=x_label, ylabel=y_label)
    return figure


def _figure(rows: int) -> tuple[Figure, list[Axes]]:
    """Return an empty figure and its plots, one above the other, with a common time axis."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_INCH, layout="constrained")
    plots = np.ravel(figure.subplots(rows, sharex=True)).tolist()
    for axes in plots:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
        axes.set_axisbelow(True)
    return figure, plots


def _draw_line(
    axes: Axes, t_s: Floats, values: Floats, colour: str, label: str | None = None, width: float = 1.2
) -> None:
    """Draw the shown part of a trial with at most `POINTS_PER_S` points per second."""
    every = max(round(1 / (POINTS_PER_S * float(np.median(np.diff(t_s))))), 1)
    at_s = t_s[::every]
    shown = (at_s >= 0) & (at_s < SHOWN_S)
    axes.plot(at_s[shown], values[::every][shown], color=colour, linewidth=width, label=label)


def _begin_s(trial: TrialEvaluation) -> float:
    """Return the time [s] at which a figure begins: `LEAD_S` before the first contact."""
    first_s = float(trial.processed.trial.t_s[0])
    return max([first_s, *(contact.final_s - LEAD_S for contact in trial.evaluable_contacts[:1])])


def _add_legends(*plots: Axes) -> None:
    for axes in plots:
        axes.legend(frameon=False, ncols=3, fontsize=8, loc="lower right", bbox_to_anchor=(1, 1))
