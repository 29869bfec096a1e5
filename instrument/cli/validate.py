"""`pneuforce validate`: the paper's experiment, simulated or recorded, beside the paper's figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rich.console import Console

from instrument.chain import ChainSettings
from instrument.cli.validation_source import Choice, Source, source_of
from instrument.cli.validation_table import shown
from instrument.errors import ConfigurationError
from instrument.model import Law
from instrument.model.balloon import LOWEST_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA
from instrument.validation import recording
from instrument.validation.report import Report, as_tables, report_of, seen
from instrument.whole_file import check_writable

FEWEST_CONTACTS = 3


def validate(choice: Choice, law: Law, save: Path | None, figures: Path | None, as_json: bool) -> None:
    """Print the report. Raises ConfigurationError where a file or an option cannot be used."""
    if figures is not None:
        from instrument.validation.figures import prepared

        prepared(figures)
    if save is not None:
        _saveable(save, choice)
    source = source_of(choice)
    if save is not None:
        recording.write(save, source.trials)
    settings = ChainSettings(law=law)
    trials = seen(source.trials, settings)
    report, peaks = report_of(trials, settings)
    _enough(report, choice.name)
    if figures is not None:
        from instrument.cli.validation_figures import draw

        draw(figures, choice, trials, peaks, settings)
    if as_json:
        print(json.dumps(answer(source, law, report), indent=2, ensure_ascii=False))
    else:
        Console().print(shown(report, source.facts, source.note))


def answer(source: Source, law: Law, report: Report) -> dict[str, Any]:
    """The whole answer as JSON has it."""
    how = {"switch": law.switch, "low": law.low}
    return {"source": source.facts, "law": how, **as_tables(report), "note": source.note}


def _saveable(save: Path, choice: Choice) -> None:
    """Fail before the long run, not after it."""
    if choice.data is not None:
        raise ConfigurationError("--save is for what is simulated: it does not go with --data")
    check_writable(save)


def _enough(report: Report, name: str) -> None:
    counts = report.counts
    if counts.evaluated < FEWEST_CONTACTS:
        raise ConfigurationError(
            f"{name}: {counts.evaluated} contacts to be evaluated, at least {FEWEST_CONTACTS} are needed; "
            f"{counts.found} were found, of them {counts.too_small} with a rise below {LOWEST_RISE_KPA} kPa, "
            f"{counts.out_of_range} with ΔP_i outside {VALID_LOW_KPA} to {VALID_HIGH_KPA} kPa, "
            f"{counts.without_force} that the reference did not feel"
        )
