"""Run of `pneuforce estimate` and `pneuforce uncertainty`: options, computation, output."""

from __future__ import annotations

from typing import NamedTuple

from pneuforce.errors import ConfigurationError, InvalidForce
from pneuforce.instrument.cli.model.estimate import (
    budget_json,
    estimate_contact,
    estimate_json,
    format_budget,
    format_estimate,
    problem,
)
from pneuforce.instrument.cli.model.estimate_table import ForceRow, force_csv, force_facts, read_force_rows
from pneuforce.instrument.cli.model.force_options import EstimateInput, ForceOptions
from pneuforce.instrument.cli.model.force_settings import force_settings
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.instrument.cli.terminal.failure import failure_values
from pneuforce.instrument.cli.terminal.output import done_values, json_line, print_text
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.support.atomic_file import check_new, write_lines
from pneuforce.support.counted import counted

NO_VALID_ROW = "no contact has a valid force, see the column reason"


class _Result(NamedTuple):
    text: str
    problem: str  #: reason why there is no force; "" if there is a force


def estimate(given: EstimateInput, options: ForceOptions, *, budget: bool, as_json: bool) -> int:
    """Print the force of one contact or of a table, with the uncertainty budget if `budget` is True.

    Returns the exit code. Raises ConfigurationError if an option or a file is invalid, and InvalidForce if
    there is no force at all and the printed JSON does not say so.
    """
    pressures = [value is not None for value in (given.dpi, given.dpf)]
    if any(pressures) if given.contacts is not None else not all(pressures):
        raise ConfigurationError("give either --dpi and --dpf, or a file with --csv")
    if given.out is not None:
        check_new(given.out, given.overwrite)
    settings = force_settings(options)
    if given.contacts is None:
        result = _contact_result(given, settings, budget, as_json)
    else:
        rows = read_force_rows(given.contacts, settings, given.contact_s, budget)
        result = _table_result(given, rows, as_json)
    if given.out is None:
        print_text(result.text)
    else:
        write_lines(given.out, [result.text, "\n"])
    if result.problem and as_json and given.out is None:
        return ExitCode.FAILED
    if result.problem:
        raise InvalidForce(("out_of_range",), result.problem)
    return ExitCode.DONE


def _table_result(given: EstimateInput, rows: list[ForceRow], as_json: bool) -> _Result:
    valid_count = sum(row.valid for row in rows)
    problem = "" if valid_count else f"{given.contacts}: {NO_VALID_ROW}"
    if not as_json:
        return _Result(force_csv(rows).rstrip("\n"), problem)
    if problem:
        values = failure_values(InvalidForce(("out_of_range",), problem))
    else:
        values = done_values(f"{valid_count} of {counted(len(rows), 'contact')} have a force")
    return _Result(json_line(values | {"contacts": force_facts(rows)}), problem)


def _contact_result(given: EstimateInput, settings: ChainSettings, budget: bool, as_json: bool) -> _Result:
    assert given.dpi is not None
    assert given.dpf is not None
    contact = estimate_contact(given.dpi, given.dpf, settings, given.contact_s)
    if as_json:
        text = budget_json(contact) if budget else estimate_json(contact)
    else:
        text = format_budget(contact) if budget else format_estimate(contact)
    return _Result(text, problem(contact))
