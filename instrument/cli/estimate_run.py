"""Run of `pneuforce estimate` and `pneuforce uncertainty`: options, computation, output."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.estimate import (
    budget_json,
    estimate_contact,
    estimate_json,
    format_budget,
    format_estimate,
)
from pneuforce.instrument.cli.estimate_table import force_csv, force_facts, read_force_rows
from pneuforce.instrument.cli.force_settings import ForceOptions
from pneuforce.instrument.cli.output import json_text, print_text
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.support.atomic_file import check_new, write_lines


class EstimateInput(NamedTuple):
    """Pressures of one contact or file with the pressures of many contacts, and the output file."""

    baseline_kpa: float | None
    final_kpa: float | None
    contacts: Path | None
    out: Path | None
    overwrite: bool


def estimate(given: EstimateInput, options: ForceOptions, *, budget: bool, as_json: bool) -> None:
    """Print the force of one contact or of a table, with the uncertainty budget if `budget` is True.

    Raises ConfigurationError if an option or a file is invalid.
    """
    pressures = [value is not None for value in (given.baseline_kpa, given.final_kpa)]
    if any(pressures) if given.contacts is not None else not all(pressures):
        raise ConfigurationError("give either --dpi and --dpf, or a file with --csv")
    if given.out is not None:
        check_new(given.out, given.overwrite)
    settings = options.settings()
    if given.contacts is None:
        text = _contact_text(given, settings, budget, as_json)
    else:
        rows = read_force_rows(given.contacts, settings, budget)
        text = json_text(force_facts(rows), indent=2) if as_json else force_csv(rows).rstrip("\n")
    if given.out is None:
        print_text(text)
    else:
        write_lines(given.out, [text, "\n"])


def _contact_text(given: EstimateInput, settings: ChainSettings, budget: bool, as_json: bool) -> str:
    assert given.baseline_kpa is not None
    assert given.final_kpa is not None
    contact = estimate_contact(given.baseline_kpa, given.final_kpa, settings)
    if as_json:
        return budget_json(contact) if budget else estimate_json(contact)
    return format_budget(contact) if budget else format_estimate(contact)
