"""Figure of a recording in the style of Fig. 6 of the paper.

The upper plot shows the pressure, with stars at ΔP_i and ΔP_f. The lower plot shows the force.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from pneuforce.instrument.recording.contacts import ContactRow
from pneuforce.instrument.recording.plot_data import MAX_SPANS, NO_SAMPLES, PlotData, Points, UnmeasuredSpan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Style = dict[str, Any]

SIZE_INCH = (6.4, 5.2)
#: The colours differ in lightness, for prints without colour and for red-green colour blindness.
BLUE, YELLOW, RED, PALE, BLACK = "#1f4e9c", "#f7c600", "#c8102e", "#93a1b3", "#222222"
PAPER: Style = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
VENT: Style = {"facecolor": "#e4e4e4", "edgecolor": "none"}
SILENCE: Style = {"facecolor": "none", "edgecolor": "#bbbbbb", "hatch": ".."}
TRIP: Style = {"facecolor": "#f8e0dc", "edgecolor": "#d98a80", "hatch": "///"}
#: Units of the time axis: longest duration that is shown in this unit [s], name, and length of the unit [s].
UNITS = ((600.0, "s", 1.0), (3 * 3600.0, "min", 60.0), (math.inf, "h", 3600.0))
MAX_NUMBERED_CONTACTS = 30
NUMBERING_STEPS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
MIN_NAMED_SPAN = 0.025  #: fraction of the figure's width above which a span is named
HEADROOM = 0.3  #: margin above and below the pressures of the contacts, as a fraction of their range
#: Limits of the force axis, as fractions of the greatest peak force plus 2u.
FORCE_AXIS_LOW, FORCE_AXIS_HIGH = -0.2, 1.1
MIN_RANGE_KPA = 0.5


@contextmanager
def reproducible_style() -> Iterator[None]:
    """Make figures reproducible: equal data gives equal bytes. SVG files contain text, not outlines."""
    from matplotlib import rc_context, rcdefaults, rcParams

    settings: Any = {
        "font.size": 11,
        "hatch.linewidth": 0.6,
        "pdf.fonttype": 42,  # TrueType, which programs for vector graphics can edit
        "svg.fonttype": "none",
        "svg.hashsalt": "pneuforce",
    }
    with rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the font may lack characters of the title
        rcdefaults()  # the user's matplotlibrc has no effect
        rcParams.update(settings)
        yield


def set_title(axes: Axes, title: str) -> None:
    """Set the title of a figure. Characters that cannot be printed become question marks."""
    shown = "".join(letter if letter.isprintable() else "?" for letter in title)
    axes.set_title(shown, loc="left", fontsize=11, parse_math=False)


def draw_figure(data: PlotData, title: str) -> Figure:
    """Return the figure: pressure with stars at ΔP_i and ΔP_f, and force with the band of ±2u, over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_INCH, layout="constrained")
    above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    unit, unit_s = _unit(data)
    scale = _Scale(data.begin_s, unit_s)
    _draw_pressures(above, data, scale)
    _draw_force(below, data, scale)
    for axes in (above, below):
        _draw_frame(axes, data, scale)
    _name_spans(above, data, scale)
    set_title(above, title)
    below.set_xlabel("\n".join([f"time in the recording [{unit}]", *_notes(data)]))
    handles, names = (
        [*one, *other]
        for one, other in zip(
            above.get_legend_handles_labels(), below.get_legend_handles_labels(), strict=True
        )
    )
    figure.legend(handles, names, loc="outside lower center", ncols=3, frameon=False, fontsize=10)
    return figure


class _Scale:
    """Conversion from the clock of the host process to the time axis of the figure."""

    def __init__(self, begin_s: float, unit_s: float) -> None:
        self.begin_s, self.unit_s = begin_s, unit_s

    def __call__(self, t_s: Any) -> Any:
        return (np.asarray(t_s, float) - self.begin_s) / self.unit_s


def _unit(data: PlotData) -> tuple[str, float]:
    length_s = data.end_s - data.begin_s if data.samples else 0.0
    return next((unit, unit_s) for max_s, unit, unit_s in UNITS if length_s <= max_s)


def _notes(data: PlotData) -> Iterator[str]:
    """Yield a line for each kind of data that is not drawn completely."""
    if data.force.decimated and data.samples > 1:
        bucket_s = data.force.points_per_bucket * (data.end_s - data.first_s) / (data.samples - 1)
        count = f"{data.samples:,}".replace(",", "\u202f")
        yield f"{count} samples; the minimum and the maximum of each {bucket_s:.2g} s are drawn"
    if data.has_more_spans:
        yield f"only the first {MAX_SPANS} grey, hatched and dotted areas are drawn"


def _draw_frame(axes: Axes, data: PlotData, scale: _Scale) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.25)
    axes.set_axisbelow(True)
    if data.samples:
        low, high = scale((data.first_s, data.end_s)).tolist()
        axes.set_xlim(low, max(high, low + 1e-3))
    else:
        axes.set_xticks([])
    for span in data.spans:
        style = TRIP if span.trip else SILENCE if span.name == NO_SAMPLES else VENT
        axes.axvspan(*scale((span.begin_s, span.end_s)).tolist(), zorder=0, linewidth=0, **style)


def _draw_pressures(axes: Axes, data: PlotData, scale: _Scale) -> None:
    _draw_curve(axes, data.points(data.pressure), scale, PALE, "pressure, filtered")
    _draw_curve(axes, data.points(data.contact_pressure), scale, BLUE, "in the balloon, in contact")
    setpoint = data.points(data.setpoint)
    axes.plot(scale(setpoint[:, 0]), setpoint[:, 1], "--", color=BLACK, linewidth=1.0, label="setpoint")
    rows = [row for row in data.contacts if math.isfinite(row.baseline_kpa + row.final_kpa)]
    size = 13 if len(rows) <= MAX_NUMBERED_CONTACTS else 7
    for name, colour, at in (
        ("ΔP_i", YELLOW, [(row.initial_s, row.baseline_kpa) for row in rows]),
        ("ΔP_f", RED, [(row.final_s, row.final_kpa) for row in rows]),
    ):
        t_s, pressure_kpa = np.array(at, float).reshape(-1, 2).T
        style: Style = {"markersize": size, "markeredgecolor": BLACK, "markeredgewidth": 0.7, "gid": name}
        axes.plot(scale(t_s), pressure_kpa, "*", color=colour, label=name, zorder=4, **style)
    _draw_numbers(axes, rows, scale)
    axes.set_ylabel("pressure [kPa]")
    if rows:
        axes.set_ylim(*_range_kpa(rows))
    else:
        low_kpa, high_kpa = axes.get_ylim()
        axes.set_ylim(min(low_kpa, -MIN_RANGE_KPA), max(high_kpa, MIN_RANGE_KPA))


def _range_kpa(rows: list[ContactRow]) -> tuple[float, float]:
    """Return the limits of the pressure axis: the range of ΔP_i and ΔP_f of all contacts, with a margin.

    The pressure during an inflation or a vent can be outside these limits.
    """
    low_kpa, high_kpa = min(row.baseline_kpa for row in rows), max(row.final_kpa for row in rows)
    margin_kpa = HEADROOM * max(high_kpa - low_kpa, MIN_RANGE_KPA)
    return low_kpa - margin_kpa, high_kpa + margin_kpa


def _draw_numbers(axes: Axes, rows: list[ContactRow], scale: _Scale) -> None:
    """Draw the number of each contact, or of every n-th contact if there are many; see NUMBERING_STEPS."""
    every = next(
        (step for step in NUMBERING_STEPS if len(rows) <= step * MAX_NUMBERED_CONTACTS), NUMBERING_STEPS[-1]
    )
    for row in rows:
        if row.number % every == 0:
            at = (float(scale(row.final_s)), row.final_kpa)
            style: Style = {"textcoords": "offset points", "ha": "center", "fontsize": 10, "zorder": 5}
            axes.annotate(str(row.number), at, (0, 7), gid="number", **style)


def _draw_force(axes: Axes, data: PlotData, scale: _Scale) -> None:
    t_s, force_n, std_n = data.points(data.force).T
    axes.fill_between(
        scale(t_s), force_n - 2 * std_n, force_n + 2 * std_n, color=BLUE, alpha=0.25, linewidth=0, label="±2u"
    )
    axes.plot(scale(t_s), force_n, color=BLUE, linewidth=1.3, label="force")
    axes.set_ylabel("force [N]")
    bounds_n = [row.peak_n + 2 * row.peak_std_n for row in data.contacts if row.peak_n > 0]
    bounds_n = [bound_n for bound_n in bounds_n if math.isfinite(bound_n)]
    # If the pressure falls abruptly, for example in a burst, the uncertainty is infinite and gives no limit.
    if bounds_n:
        axes.set_ylim(FORCE_AXIS_LOW * max(bounds_n), FORCE_AXIS_HIGH * max(bounds_n))
    if data.remark:
        axes.set_ylim(-0.5, 1.0)
        centred: Style = {"transform": axes.transAxes, "ha": "center", "va": "center"}
        axes.text(0.5, 0.7, data.remark, fontsize=13, bbox=PAPER, **centred)


def _draw_curve(axes: Axes, points: Points, scale: _Scale, colour: str, name: str) -> None:
    axes.plot(scale(points[:, 0]), points[:, 1], color=colour, linewidth=1.3, label=name, gid=name)


def _name_spans(axes: Axes, data: PlotData, scale: _Scale) -> None:
    """Draw the name of each wide span, rotated by 90°. A trip is named once, even if its span is narrow."""
    length_s, previous = data.end_s - data.first_s, ""
    min_s = MIN_NAMED_SPAN * length_s
    for span in data.spans:
        if span.end_s - span.begin_s > min_s or (span.trip and span.name != previous):
            middle_s = (span.begin_s + span.end_s) / 2
            at_s = min(max(middle_s, data.first_s + min_s), data.end_s - min_s)
            _draw_name(axes, span, float(scale(at_s)))
        if span.name != NO_SAMPLES:
            previous = span.name


def _draw_name(axes: Axes, span: UnmeasuredSpan, at: float) -> None:
    text = f"tripped: {span.name}" if span.trip else span.name
    place: Style = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "bottom"}
    axes.text(at, 0.04, text, rotation=90, fontsize=10, bbox=PAPER, parse_math=False, **place)
