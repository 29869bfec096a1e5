"""Plot of a recording: the pressure and the force over time, or one bar per pressure bin."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.model import ForceLaw
from pneuforce.instrument.recording.plot_data import PlotData
from pneuforce.instrument.recording.plot_drawing import draw_figure, reproducible_style, set_title
from pneuforce.instrument.recording.reader import Recording, short_text
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.instrument.validation import by_pressure
from pneuforce.instrument.validation.figures import pressure_bin_bars
from pneuforce.instrument.validation.reference_alignment import ReferenceInput
from pneuforce.support.atomic_file import check_new, replaced_user_file
from pneuforce.support.columns import Points

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Metadata by file format. Date and program are left out, so that equal data gives equal files.
METADATA = {
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
DOTS_PER_INCH = 160
#: Limits for the fault names in an event. The longest name of a fault has 20 characters.
MAX_NAMES, MAX_NAME_LENGTH = 32, 40

Samples = Iterable[SampleRecord]


class PlotOptions(NamedTuple):
    """Recording, time range, kind and output file of a plot."""

    recording: Path
    out: Path | None = None
    from_s: float = -math.inf
    to_s: float = math.inf
    by_pressure: bool = False
    reference: ReferenceInput | None = None
    title: str | None = None
    overwrite: bool = False

    def check(self) -> None:
        """Raise ConfigurationError if options contradict each other or the file cannot be written."""
        if self.reference is not None and not self.by_pressure:
            raise ConfigurationError("--reference is valid only with --by-pressure")
        if not self.from_s < self.to_s:
            raise ConfigurationError("--from-s must be less than --to-s")
        check_new(self.file, self.overwrite)

    @property
    def file(self) -> Path:
        """Return the output file. Raises ConfigurationError if its format is unknown."""
        out = self.out or self.recording.with_suffix(".png")
        if out.suffix.lower() not in METADATA:
            raise ConfigurationError(f"{out}: the format is unknown: name a file .png, .svg or .pdf")
        return out


def collect(recording: Recording, samples: Samples, tube_time_constant_s: float) -> PlotData:
    """Return the samples of a recording, each with the faults that were latched at its time."""
    data = PlotData(recording.begin_s, tube_time_constant_s)
    faults = _latched_faults(recording)
    data.set_latched_faults(next(faults)[1])
    next_t_s, latched = next(faults)
    for m in samples:
        while m.t_s >= next_t_s:
            data.set_latched_faults(latched)
            next_t_s, latched = next(faults)
        data.add_sample(m)
    return data


def _latched_faults(recording: Recording) -> Iterator[tuple[float, tuple[str, ...]]]:
    """Yield the time [s] of each change of the latched faults, and the faults after the change.

    The first time is the beginning of the recording. The last time is infinite.
    """
    yield recording.begin_s, _names(recording.metadata.get("faults"))
    for record in recording.events():
        at_s = record.get("mono_s")
        if record.get("kind") == "faults" and isinstance(at_s, float | int):
            yield at_s, _names(record.get("is"))
    yield math.inf, ()


def _names(value: Any) -> tuple[str, ...]:
    """Return the fault names in `value`; () if `value` is not a list, as in a manipulated recording."""
    names = value[:MAX_NAMES] if isinstance(value, list) else ()
    return tuple(short_text(name)[:MAX_NAME_LENGTH] for name in names)


def recorded_method(recording: Recording) -> str:
    """Return the force model in the configuration of a recording, otherwise the default."""
    tables: Any = recording.metadata
    for name in ("configuration", "measurement"):
        tables = tables.get(name)
        if not isinstance(tables, Mapping):
            return ForceLaw().method
    return str(tables.get("method", ForceLaw().method))


def write(
    data: PlotData, options: PlotOptions, title: str, method: str, reference: Points | None = None
) -> None:
    """Draw the figure and write the file. Raises ConfigurationError if a file cannot be used.

    `method` is the force model. The times of the reference force count from the beginning of the recording.
    """
    with reproducible_style():
        _save(
            _draw_bars(data, reference, title, method) if options.by_pressure else draw_figure(data, title),
            options.file,
        )


def _draw_bars(data: PlotData, reference: Points | None, title: str, method: str) -> Figure:
    """Draw one bar per pressure bin: the error if there is a reference, else the reported uncertainty."""
    if reference is None:
        quantity, bars = "mean relative uncertainty u [%]", by_pressure.uncertainty_by_bin(data.contacts)
    else:
        quantity = "mean absolute error of the peak [%]"
        bars = by_pressure.error_by_bin(
            data.contacts, by_pressure.ReferenceForce(reference["t_s"] + data.begin_s, reference["force_n"])
        )
    names = [f"{bar.name}\nn = {bar.contacts}" for bar in bars]
    percents = [bar.percent for bar in bars]
    figure = pressure_bin_bars(
        names, percents, "inflating pressure ΔP_i [kPa]", quantity, two_energies=method == "energetic"
    )
    axes = figure.axes[0]
    set_title(axes, title)
    axes.margins(y=0.1)
    if not any(bar.contacts for bar in bars):
        axes.text(0.5, 0.5, _empty_text(data, reference), transform=axes.transAxes, ha="center", fontsize=13)
        axes.set_ylim(0, 1)
        axes.set_yticks([])
    return figure


def _empty_text(data: PlotData, reference: Points | None) -> str:
    """Return the reason why there is no bar."""
    with_reference = " with a reference force" if reference is not None else ""
    return data.remark or f"no contact of more than 0.5 kPa{with_reference}"


def _save(figure: Figure, file: Path) -> None:
    suffix = file.suffix.lower()
    with replaced_user_file(file) as new:
        figure.savefig(new, format=suffix[1:], dpi=DOTS_PER_INCH, metadata=METADATA[suffix])
