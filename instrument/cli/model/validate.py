"""`pneuforce validate`: repeat the experiment of the paper with simulated or recorded data."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.model.force_options import ForceOptions
from pneuforce.instrument.cli.model.force_settings import force_settings
from pneuforce.instrument.cli.model.validation_source import (
    SourceOptions,
    ValidationSource,
    load_source,
    with_configuration,
)
from pneuforce.instrument.cli.model.validation_table import render_report
from pneuforce.instrument.cli.terminal.output import done_json, print_text
from pneuforce.instrument.model import ForceLaw
from pneuforce.instrument.model.balloon import MIN_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.validation import recording
from pneuforce.instrument.validation.instrument_errors import instrument_errors
from pneuforce.instrument.validation.report import (
    ValidationReport,
    build_report,
    evaluate_trials,
    report_to_json,
)
from pneuforce.support.atomic_file import check_new
from pneuforce.support.counted import counted

MIN_CONTACTS = 3


class OutputFiles(NamedTuple):
    """Files that the command writes."""

    recording: Path | None  #: CSV file for the simulated recording
    figures: Path | None  #: folder for the figures
    overwrite: bool


def validate(options: SourceOptions, force: ForceOptions, files: OutputFiles, as_json: bool) -> None:
    """Print the report. Raises ConfigurationError if a file or an option cannot be used."""
    _check_files(files, options)
    settings = force_settings(force)
    source = load_source(options)
    if force.config is not None:
        source = with_configuration(source, force.config)
    if files.recording is not None:
        recording.write(files.recording, source.trials)
    trials = evaluate_trials(source.trials, settings)
    report, peaks = build_report(trials, settings)
    if force.config is not None:
        report = report._replace(instrument=instrument_errors(peaks, peaks.instrument, settings))
    _check_contacts(report, options.name)
    if files.figures is not None:
        from pneuforce.instrument.cli.model.validation_figures import draw_figures

        draw_figures(files.figures, options, trials, peaks, settings)
    if as_json:
        evaluated = f"{report.counts.evaluated} of {counted(report.counts.found, 'contact')} were evaluated"
        message = "; ".join(filter(None, [evaluated, source.remark]))
        print_text(done_json(message, **report_json(source, settings.law, report)))
    else:
        if source.remark:
            print_text(f"pneuforce: {source.remark}", sys.stderr)
        Console().print(render_report(report, source.facts, source.note))


def report_json(source: ValidationSource, law: ForceLaw, report: ValidationReport) -> dict[str, Any]:
    """Return the report as JSON data."""
    law_facts = {"method": law.method, "switch": law.switch, "low": law.low}
    return {
        "source": source.facts,
        "law": law_facts,
        **report_to_json(report),
        "note": source.note,
        "remark": source.remark,
    }


def _check_files(files: OutputFiles, options: SourceOptions) -> None:
    """Raise ConfigurationError if a file cannot be written. Call this before the long simulation."""
    if files.figures is not None:
        from pneuforce.instrument.validation.figures import prepare_folder

        prepare_folder(files.figures, files.overwrite)
    if files.recording is not None:
        if options.data is not None:
            raise ConfigurationError("--save writes a simulated recording: it is not valid with --data")
        check_new(files.recording, files.overwrite)


def _check_contacts(report: ValidationReport, name: str) -> None:
    """Raise ConfigurationError if there are too few contacts to evaluate."""
    counts = report.counts
    if counts.evaluated < MIN_CONTACTS:
        raise ConfigurationError(
            f"{name}: {counted(counts.evaluated, 'contact')} can be evaluated, "
            f"and at least {MIN_CONTACTS} are needed; "
            f"{counts.found} were found, of them {counts.cut} pressed since the start of the trial, "
            f"{counts.too_small} with a rise below {MIN_RISE_KPA} kPa, "
            f"{counts.out_of_range} with ΔP_i outside {VALID_LOW_KPA} to {VALID_HIGH_KPA} kPa, "
            f"{counts.without_force} without a reference force"
        )
