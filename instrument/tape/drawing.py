"""The figure of a recording, after the paper's Fig. 6: stars on the pressure above, the force below."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from instrument.tape.contacts import ContactRow
from instrument.tape.picture import SILENT, Picture, Points, Span

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Style = dict[str, Any]

SIZE_INCH = (6.4, 5.2)
#: Light and dark are told apart in print without colour, and by those who see red and green alike.
BLUE, YELLOW, RED, PALE, BLACK = "#1f4e9c", "#f7c600", "#c8102e", "#93a1b3", "#222222"
PAPER: Style = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
VENT: Style = {"facecolor": "#e4e4e4", "edgecolor": "none"}
SILENCE: Style = {"facecolor": "none", "edgecolor": "#bbbbbb", "hatch": ".."}
TRIP: Style = {"facecolor": "#f8e0dc", "edgecolor": "#d98a80", "hatch": "///"}
#: Longest time that is shown in a unit, the unit, and what it has in seconds.
UNITS = ((600.0, "s", 1.0), (3 * 3600.0, "min", 60.0), (math.inf, "h", 3600.0))
MOST_NUMBERS = 30
STEPS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
LEAST_NAMED = 0.025  #: share of the figure's width that a span needs for its name
HEADROOM = 0.3  #: share of the contacts' range of pressure that is shown above and below it
ROOM_BELOW, ROOM_ABOVE = 0.2, 1.1  #: what is shown of the force, of its greatest upper bound
LEAST_RANGE_KPA = 0.5


@contextmanager
def drawn_alike() -> Iterator[None]:
    """A figure made and saved in here has the same bytes each time, and its letters are text in SVG."""
    from matplotlib import rc_context, rcdefaults, rcParams

    own: Any = {"font.size": 11, "hatch.linewidth": 0.6, "svg.fonttype": "none", "svg.hashsalt": "pneuforce"}
    with rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of letters that its font has not
        rcdefaults()  # whatever the user's own matplotlibrc says
        rcParams.update(own)
        yield


def titled(axes: Axes, title: str) -> None:
    """Put the title over a figure; what no file can hold is a question mark."""
    shown = "".join(letter if letter.isprintable() else "?" for letter in title)
    axes.set_title(shown, loc="left", fontsize=11, parse_math=False)


def figure_of(picture: Picture, title: str) -> Figure:
    """Pressure with its stars, and the force with its ±2u, over one time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_INCH, layout="constrained")
    above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    unit, unit_s = _unit(picture)
    scale = _Scale(picture.begin_s, unit_s)
    _pressures(above, picture, scale)
    _force(below, picture, scale)
    for axes in (above, below):
        _plain(axes, picture, scale)
    _name_spans(above, picture, scale)
    titled(above, title)
    below.set_xlabel("\n".join([f"time in the recording [{unit}]", *_thinned(picture)]))
    handles, names = (
        [*one, *other]
        for one, other in zip(
            above.get_legend_handles_labels(), below.get_legend_handles_labels(), strict=True
        )
    )
    figure.legend(handles, names, loc="outside lower center", ncols=3, frameon=False, fontsize=10)
    return figure


class _Scale:
    """From the host's clock to the figure's time."""

    def __init__(self, begin_s: float, unit_s: float) -> None:
        self.begin_s, self.unit_s = begin_s, unit_s

    def __call__(self, t_s: Any) -> Any:
        return (np.asarray(t_s, float) - self.begin_s) / self.unit_s


def _unit(picture: Picture) -> tuple[str, float]:
    length_s = picture.end_s - picture.begin_s if picture.samples else 0.0
    return next((unit, unit_s) for most_s, unit, unit_s in UNITS if length_s <= most_s)


def _thinned(picture: Picture) -> list[str]:
    """A sentence where not every sample is drawn."""
    if not picture.force.thinned or picture.samples < 2:
        return []
    each_s = picture.force.each * (picture.end_s - picture.first_s) / (picture.samples - 1)
    count = f"{picture.samples:,}".replace(",", "\u202f")
    return [f"{count} samples: of each {each_s:.2g} s the least and the greatest are drawn"]


def _plain(axes: Axes, picture: Picture, scale: _Scale) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.25)
    axes.set_axisbelow(True)
    if picture.samples:
        low, high = scale((picture.first_s, picture.end_s)).tolist()
        axes.set_xlim(low, max(high, low + 1e-3))
    else:
        axes.set_xticks([])
    for span in picture.spans:
        style = TRIP if span.trip else SILENCE if span.name == SILENT else VENT
        axes.axvspan(*scale((span.begin_s, span.end_s)).tolist(), zorder=0, linewidth=0, **style)


def _pressures(axes: Axes, picture: Picture, scale: _Scale) -> None:
    _curve(axes, picture.points(picture.pressure), scale, PALE, "pressure, filtered")
    _curve(axes, picture.points(picture.pressed), scale, BLUE, "in the balloon, in contact")
    setpoint = picture.points(picture.setpoint)
    axes.plot(scale(setpoint[:, 0]), setpoint[:, 1], "--", color=BLACK, linewidth=1.0, label="setpoint")
    rows = picture.contacts
    size = 13 if len(rows) <= MOST_NUMBERS else 7
    for name, colour, at in (
        ("ΔP_i", YELLOW, [(row.initial_s, row.initial_kpa) for row in rows]),
        ("ΔP_f", RED, [(row.final_s, row.final_kpa) for row in rows]),
    ):
        t_s, pressure_kpa = np.array(at, float).reshape(-1, 2).T
        style: Style = {"markersize": size, "markeredgecolor": BLACK, "markeredgewidth": 0.7, "gid": name}
        axes.plot(scale(t_s), pressure_kpa, "*", color=colour, label=name, zorder=4, **style)
    _number(axes, rows, scale)
    axes.set_ylabel("pressure [kPa]")
    if rows:
        axes.set_ylim(*_range_kpa(rows))
    else:
        low_kpa, high_kpa = axes.get_ylim()
        axes.set_ylim(min(low_kpa, -LEAST_RANGE_KPA), max(high_kpa, LEAST_RANGE_KPA))


def _range_kpa(rows: list[ContactRow]) -> tuple[float, float]:
    """The pressures of the contacts and some room: filling and venting may leave the figure."""
    low_kpa, high_kpa = min(row.initial_kpa for row in rows), max(row.final_kpa for row in rows)
    room_kpa = HEADROOM * max(high_kpa - low_kpa, LEAST_RANGE_KPA)
    return low_kpa - room_kpa, high_kpa + room_kpa


def _number(axes: Axes, rows: list[ContactRow], scale: _Scale) -> None:
    """The number of each contact; where there are many of each second, fifth and so on, see STEPS."""
    each = next((step for step in STEPS if len(rows) <= step * MOST_NUMBERS), STEPS[-1])
    for row in rows:
        if row.number % each == 0:
            at = (float(scale(row.final_s)), row.final_kpa)
            style: Style = {"textcoords": "offset points", "ha": "center", "fontsize": 10, "zorder": 5}
            axes.annotate(str(row.number), at, (0, 7), gid="number", **style)


def _force(axes: Axes, picture: Picture, scale: _Scale) -> None:
    t_s, force_n, std_n = picture.points(picture.force).T
    axes.fill_between(
        scale(t_s), force_n - 2 * std_n, force_n + 2 * std_n, color=BLUE, alpha=0.25, linewidth=0, label="±2u"
    )
    axes.plot(scale(t_s), force_n, color=BLUE, linewidth=1.3, label="force")
    axes.set_ylabel("force [N]")
    bounds_n = [row.peak_n + 2 * row.peak_std_n for row in picture.contacts if row.peak_n > 0]
    tops_n = [bound_n for bound_n in bounds_n if math.isfinite(bound_n)]
    if tops_n:  # where the pressure falls at once, as in a burst, the band has no bounds
        axes.set_ylim(-ROOM_BELOW * max(tops_n), ROOM_ABOVE * max(tops_n))
    if picture.remark:
        axes.set_ylim(-0.5, 1.0)
        middle: Style = {"transform": axes.transAxes, "ha": "center", "va": "center"}
        axes.text(0.5, 0.7, picture.remark, fontsize=13, bbox=PAPER, **middle)


def _curve(axes: Axes, points: Points, scale: _Scale, colour: str, name: str) -> None:
    axes.plot(scale(points[:, 0]), points[:, 1], color=colour, linewidth=1.3, label=name, gid=name)


def _name_spans(axes: Axes, picture: Picture, scale: _Scale) -> None:
    """The name of each span that is wide enough, upright; of a trip always, but once."""
    length_s, before = picture.end_s - picture.first_s, ""
    room_s = LEAST_NAMED * length_s
    for span in picture.spans:
        if span.end_s - span.begin_s > room_s or (span.trip and span.name != before):
            middle_s = (span.begin_s + span.end_s) / 2
            at_s = min(max(middle_s, picture.first_s + room_s), picture.end_s - room_s)
            _name(axes, span, float(scale(at_s)))
        if span.name != SILENT:
            before = span.name


def _name(axes: Axes, span: Span, at: float) -> None:
    words = f"tripped: {span.name}" if span.trip else span.name
    place: Style = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "bottom"}
    axes.text(at, 0.04, words, rotation=90, fontsize=10, bbox=PAPER, **place)
