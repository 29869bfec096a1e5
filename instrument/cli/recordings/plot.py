"""`pneuforce plot`: draw a recording, and print the name of the plot, its duration and its contacts."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.recordings.aligned_reference import read_aligned
from pneuforce.instrument.cli.recordings.evaluate import evaluated_samples, version_remark
from pneuforce.instrument.cli.terminal.failure import checked_values
from pneuforce.instrument.cli.terminal.output import json_text, print_text, progress
from pneuforce.instrument.config import Configuration, load
from pneuforce.instrument.recording.contacts import tube_time_constant_of
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.plot_data import PlotData
from pneuforce.instrument.recording.reader import Recording
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.instrument.validation.figures import require_matplotlib
from pneuforce.instrument.validation.recording_plot import PlotOptions, collect, recorded_method, write
from pneuforce.support.counted import counted

PROGRESS_SAMPLES = 5000  #: number of samples between two progress reports


def plot(options: PlotOptions, config: Path | None = None, as_json: bool = False) -> int:
    """Draw the plot, with the forces of another configuration if `config` is given, and print its facts.

    Return the exit code, 1 if the recording is damaged. Raises ConfigurationError if a file or an option
    cannot be used, or if there are no samples in the time range.
    """
    options.check()
    configuration = None if config is None else load(config)
    with open_recording(options.recording) as recording:
        require_matplotlib("pneuforce plot")  # after the checks: a wrong file needs no installation
        aligned = None if options.reference is None else read_aligned(recording, options.reference)[1]
        tube_s, samples = _samples(recording, options, configuration)
        data = collect(recording, _with_progress(samples, recording.sample_count), tube_s)
        if not data.samples:
            raise ConfigurationError(recording.no_samples())
        title = options.title or _title(recording, config)
        remarks = [recording.remark(), version_remark(recording) if configuration else ""]
        method = configuration.measurement.method if configuration else recorded_method(recording)
        facts = _facts(recording, options, data) | (aligned.facts() if aligned else {})
    write(data, options, title, method, aligned.force if aligned else None)
    lines = [f"{options.file}: {_summary(data)}", *(aligned.summary() if aligned else ())]
    damaged = facts["damaged"]
    if as_json:
        remark = "; ".join(filter(None, remarks))
        values = checked_values(not damaged, remark if damaged else "; ".join(lines))
        print_text(json_text(values | facts | {"remark": remark}))
    else:
        for remark in filter(None, remarks):
            print_text(f"pneuforce: {remark}", sys.stderr)
        print_text("\n".join(lines))
    return 1 if damaged else 0


def _facts(recording: Recording, options: PlotOptions, data: PlotData) -> dict[str, Any]:
    return {
        "file": str(options.recording),
        "out": str(options.file),
        "samples": data.samples,
        "contacts": len(data.contacts),
        "from_s": data.first_s - recording.begin_s,
        "to_s": data.end_s - recording.begin_s,
        "damaged": bool(recording.damage),
    }


def _samples(
    recording: Recording, options: PlotOptions, configuration: Configuration | None
) -> tuple[float, Iterator[SampleRecord]]:
    """Return the time constant of the tube [s], and the samples in the time range."""
    if configuration is None:
        samples = recording.samples(options.from_s, options.to_s)
        return tube_time_constant_of(recording.metadata), samples
    evaluated = (both.evaluated for both in evaluated_samples(recording, configuration))
    first_s, last_s = recording.begin_s + options.from_s, recording.begin_s + options.to_s
    return configuration.chain.tube_time_constant_s, (m for m in evaluated if first_s <= m.t_s <= last_s)


def _title(recording: Recording, config: Path | None) -> str:
    title = recording.path.stem + ("  (simulated rig)" if recording.simulated else "")
    return title if config is None else f"{title}, evaluated with {config.name}"


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
    return f"{duration_s:.1f} s, {counted(len(contacts), 'contact')}"
