"""`pneuforce validate`: repeat the experiment of the paper with simulated or recorded data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.output import json_text, print_text
from pneuforce.instrument.cli.validation_source import SourceOptions, ValidationSource, load_source
from pneuforce.instrument.cli.validation_table import render_report
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model import ForceLaw
from pneuforce.instrument.model.balloon import MIN_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.validation import recording
from pneuforce.instrument.validation.report import (
    ValidationReport,
    build_report,
    evaluate_trials,
    report_to_json,
)
from pneuforce.support.atomic_file import check_writable

MIN_CONTACTS = 3


def validate(
    options: SourceOptions, law: ForceLaw, save: Path | None, figures: Path | None, as_json: bool
) -> None:
    """Print the report. Raises ConfigurationError if a file or an option cannot be used."""
    if figures is not None:
        from pneuforce.instrument.validation.figures import prepare_folder

        prepare_folder(figures)
    if save is not None:
        _check_save(save, options)
    source = load_source(options)
    if save is not None:
        recording.write(save, source.trials)
    settings = ChainSettings(law=law)
    trials = evaluate_trials(source.trials, settings)
    report, peaks = build_report(trials, settings)
    _check_contacts(report, options.name)
    if figures is not None:
        from pneuforce.instrument.cli.validation_figures import draw_figures

        draw_figures(figures, options, trials, peaks, settings)
    if as_json:
        print_text(json_text(report_json(source, law, report), indent=2))
    else:
        Console().print(render_report(report, source.facts, source.note))


def report_json(source: ValidationSource, law: ForceLaw, report: ValidationReport) -> dict[str, Any]:
    """Return the report as JSON data."""
    law_facts = {"switch": law.switch, "low": law.low}
    return {"source": source.facts, "law": law_facts, **report_to_json(report), "note": source.note}


def _check_save(save: Path, options: SourceOptions) -> None:
    """Raise ConfigurationError if the recording cannot be saved. Call this before the long simulation."""
    if options.data is not None:
        raise ConfigurationError("--save writes a simulated recording: it is not valid with --data")
    check_writable(save)


def _check_contacts(report: ValidationReport, name: str) -> None:
    """Raise ConfigurationError if there are too few contacts to evaluate."""
    counts = report.counts
    if counts.evaluated < MIN_CONTACTS:
        raise ConfigurationError(
            f"{name}: {counts.evaluated} contacts can be evaluated, at least {MIN_CONTACTS} are needed; "
            f"{counts.found} were found, of them {counts.too_small} with a rise below {MIN_RISE_KPA} kPa, "
            f"{counts.out_of_range} with ΔP_i outside {VALID_LOW_KPA} to {VALID_HIGH_KPA} kPa, "
            f"{counts.without_force} without a reference force"
        )
