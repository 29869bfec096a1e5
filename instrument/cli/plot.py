"""`pneuforce plot`: a picture of a recording."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from instrument.cli.showing import progress
from instrument.errors import ConfigurationError
from instrument.tape.drawing import drawn_alike, figure_of, titled
from instrument.tape.measured import Measured
from instrument.tape.opening import opened
from instrument.tape.picture import Picture
from instrument.tape.reading import Recording
from instrument.validation import by_pressure
from instrument.validation.figures import check_drawable, fifth_bars
from instrument.validation.reference import read
from instrument.whole_file import check_writable, in_place_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: What makes a file another each time is left out: when it was drawn, and with what.
ANONYMOUS = {".png": {"Software": None}, ".svg": {"Date": None, "Creator": None}}
DOTS_PER_INCH = 160
TOLD_EACH = 5000  #: samples


class Wish(NamedTuple):
    """What is to be drawn of which recording, and where to."""

    recording: Path
    out: Path | None = None
    from_s: float = -math.inf
    to_s: float = math.inf
    by_pressure: bool = False
    reference: Path | None = None
    title: str | None = None

    @property
    def file(self) -> Path:
        """The picture's file. Raises ConfigurationError: no format that is drawn."""
        out = self.out or self.recording.with_suffix(".png")
        if out.suffix.lower() not in ANONYMOUS:
            raise ConfigurationError(f"{out}: a picture is .png or .svg")
        return out


def plot(wish: Wish) -> int:
    """Draw it; exit code 1 where the recording is damaged.

    Raises ConfigurationError: a file or an option that cannot be used.
    """
    check_drawable("pneuforce plot")
    if wish.reference is not None and not wish.by_pressure:
        raise ConfigurationError("--reference goes with --by-pressure")
    if not wish.from_s < wish.to_s:
        raise ConfigurationError("--from-s must be less than --to-s")
    check_writable(wish.file)
    with opened(wish.recording) as recording:
        picture = _collected(recording, wish)
        title = wish.title or _title(recording)
        remark, damaged, begin_s = recording.remark(), bool(recording.damage), recording.begin_s
    with drawn_alike():
        figure = _bars(picture, wish, begin_s, title) if wish.by_pressure else figure_of(picture, title)
        _save(figure, wish.file)
    if remark:
        print(f"pneuforce: {remark}", file=sys.stderr)
    print(f"{wish.file}: {_told(picture)}")
    return 1 if damaged else 0


def _title(recording: Recording) -> str:
    return recording.path.stem + ("  (simulated rig)" if recording.simulated else "")


def _collected(recording: Recording, wish: Wish) -> Picture:
    picture = Picture(recording.begin_s)
    faults = _faults(recording)
    picture.latched(next(faults)[1])
    next_t_s, latched = next(faults)
    for m in _with_progress(recording.samples(wish.from_s, wish.to_s), recording.most_samples):
        while m.t_s >= next_t_s:
            picture.latched(latched)
            next_t_s, latched = next(faults)
        picture.take(m)
    return picture


def _faults(recording: Recording) -> Iterator[tuple[float, tuple[str, ...]]]:
    """When which faults were latched, in order; the last never comes."""
    yield recording.begin_s, _names(recording.about.get("faults"))
    for record in recording.events():
        at_s = record.get("mono_s")
        if record.get("kind") == "faults" and isinstance(at_s, float | int):
            yield at_s, _names(record.get("is"))
    yield math.inf, ()


def _names(told: Any) -> tuple[str, ...]:
    """Faults as a recording names them; a forged one may say anything."""
    return tuple(map(str, told)) if isinstance(told, list) else ()


def _with_progress(samples: Iterable[Measured], total: int | None) -> Iterator[Measured]:
    with progress("reading") as told:
        for number, m in enumerate(samples, 1):
            if number % TOLD_EACH == 0:
                told(number, total)
            yield m


def _bars(picture: Picture, wish: Wish, begin_s: float, title: str) -> Figure:
    """By pressure: the errors where there is a reference, else the uncertainty that was stated."""
    if wish.reference is None:
        how_much, bars = "mean relative uncertainty u [%]", by_pressure.uncertainties(picture.contacts)
    else:
        how_much = "mean absolute error of the peak [%]"
        cell = read(wish.reference)
        bars = by_pressure.errors(
            picture.contacts, by_pressure.Reference(cell["t_s"] + begin_s, cell["force_n"])
        )
    names = [f"{bar.name}\nn = {bar.contacts}" for bar in bars]
    figure = fifth_bars(names, [bar.percent for bar in bars], "inflating pressure ΔP_i [kPa]", how_much)
    axes = figure.axes[0]
    titled(axes, title)
    axes.margins(y=0.1)
    if not any(bar.contacts for bar in bars):
        axes.text(0.5, 0.5, _nothing(picture, wish), transform=axes.transAxes, ha="center", fontsize=13)
        axes.set_ylim(0, 1)
        axes.set_yticks([])
    return figure


def _nothing(picture: Picture, wish: Wish) -> str:
    felt = " that the reference felt" if wish.reference else ""
    return picture.remark or f"no contact of more than 0.5 kPa{felt}"


def _save(figure: Figure, file: Path) -> None:
    form = file.suffix.lower()
    with in_place_of(file) as new:
        figure.savefig(new, format=form[1:], dpi=DOTS_PER_INCH, metadata=ANONYMOUS[form])


def _told(picture: Picture) -> str:
    if picture.remark:
        return picture.remark
    contacts: Sequence[object] = picture.contacts
    length_s = picture.end_s - picture.first_s
    return f"{length_s:.1f} s, {len(contacts)} contact{'s' if len(contacts) != 1 else ''}"
