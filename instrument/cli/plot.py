"""`pneuforce plot`: draw a recording, and print the name of the plot, its duration and its contacts."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from functools import partial

from pneuforce.instrument.cli.output import print_text, progress
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.plot_data import PlotData
from pneuforce.instrument.recording.reader import Recording
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.instrument.validation.recording_plot import PlotOptions, collect, write

PROGRESS_SAMPLES = 5000  #: number of samples between two progress reports


def plot(options: PlotOptions) -> int:
    """Draw the plot. Return the exit code, 1 if the recording is damaged.

    Raises ConfigurationError if a file or an option cannot be used.
    """
    options.check()
    with open_recording(options.recording) as recording:
        data = collect(recording, options, partial(_with_progress, total=recording.sample_count))
        title = options.title or _title(recording)
        remark, damaged = recording.remark(), bool(recording.damage)
    write(data, options, title)
    if remark:
        print_text(f"pneuforce: {remark}", sys.stderr)
    print_text(f"{options.file}: {_summary(data)}")
    return 1 if damaged else 0


def _title(recording: Recording) -> str:
    return recording.path.stem + ("  (simulated rig)" if recording.simulated else "")


def _with_progress(samples: Iterable[SampleRecord], total: int | None) -> Iterator[SampleRecord]:
    with progress("reading") as report:
        for number, m in enumerate(samples, 1):
            if number % PROGRESS_SAMPLES == 0:
                report(number, total)
            yield m


def _summary(data: PlotData) -> str:
    if data.remark:
        return data.remark
    contacts: Sequence[object] = data.contacts
    duration_s = data.end_s - data.first_s
    return f"{duration_s:.1f} s, {len(contacts)} contact{'s' if len(contacts) != 1 else ''}"
