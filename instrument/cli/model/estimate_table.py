"""`pneuforce estimate --csv` and `uncertainty --csv`: the force of each contact in a table."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.estimation import pressure_problem
from pneuforce.instrument.cli.model.estimate import (
    NO_SOLUTION,
    finite_or_none,
    flat_reason,
    low_rise_reason,
    range_reason,
)
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.force_model import ForceModel
from pneuforce.instrument.model.uncertainty_budget import BudgetLine, compute_budget
from pneuforce.instrument.validation.accuracy import estimate_forces, largest_rises_kpa
from pneuforce.support.atomic_file import read_file
from pneuforce.support.columns import CsvRow, parse_table

#: Accepted names of the two columns with ΔP_i and ΔP_f.
PRESSURE_COLUMNS = (("baseline_kpa", "final_kpa"), ("dpi_kpa", "dpf_kpa"), ("p_i", "p_f"))
RESULT_COLUMNS = ("force_n", "force_std_n", "valid", "reason")
#: Cells for a missing pressure. The table of the contacts of a recording has an empty cell.
MISSING = ("", "nan")
#: Prefix of a column of the input file that has the name of a result.
INPUT_PREFIX = "input_"


class ForceRow(NamedTuple):
    """One contact of the table with its force."""

    cells: Mapping[str, str]  #: cells of the input file by column name
    baseline_kpa: float
    final_kpa: float
    force_n: float  #: NaN if the instrument would show no force
    force_std_n: float
    reason: str  #: reason why there is no force, or why the force has limited validity; "" if there is none
    budget: tuple[BudgetLine, ...] = ()  #: the uncertainty budget; empty if it was not requested

    @property
    def valid(self) -> bool:
        """Return True if there is a force."""
        return math.isfinite(self.force_n)


def read_force_rows(
    path: Path, settings: ChainSettings, contact_s: float, with_budget: bool
) -> list[ForceRow]:
    """Return each contact of a CSV file with its force, as the instrument would show it.

    `contact_s` is the time since each contact began. ΔP_i outside the validated range, a missing pressure,
    and a balloon that may be pressed flat give no force. Raises ConfigurationError if the file contains no
    contacts, and with the line if a cell is not a number.
    """
    table = parse_table(read_file(path), str(path))
    names = table.require_columns(*PRESSURE_COLUMNS)
    read = [_read_row(row, names) for row in table.rows]
    if not read:
        raise ConfigurationError(f"{path} contains no contacts, only the names of the columns")
    usable = [row for row in read if not row.reason]
    pressures_kpa = [(row.baseline_kpa, row.final_kpa) for row in usable]
    forces = estimate_forces(pressures_kpa, settings, contact_s)
    largest_kpa = largest_rises_kpa(pressures_kpa, settings)
    model = settings.force_model
    estimated = iter(
        _with_force(row, float(force_n), float(std_n), (model.lower_range_rise_kpa, float(end_kpa)))
        for row, force_n, std_n, end_kpa in zip(usable, *forces, largest_kpa, strict=True)
    )
    rows = [row if row.reason else next(estimated) for row in read]
    if not with_budget:
        return rows
    return [
        row._replace(budget=_budget(row, model, settings, contact_s)) if row.valid else row for row in rows
    ]


def _read_row(row: CsvRow, names: Sequence[str]) -> ForceRow:
    """Return a contact without its force, and the reason if its pressures give no valid force."""
    baseline_kpa, final_kpa = (_pressure_kpa(row, name) for name in names)
    reason = pressure_problem(baseline_kpa, final_kpa, (names[0], names[1]))
    if not reason and not VALID_LOW_KPA <= baseline_kpa <= VALID_HIGH_KPA:
        reason = range_reason(baseline_kpa)
    return ForceRow(row.cells, baseline_kpa, final_kpa, math.nan, math.nan, reason)


def _pressure_kpa(row: CsvRow, name: str) -> float:
    """Return a pressure, NaN if the cell is empty or "nan". Raises ConfigurationError if it is no number."""
    return math.nan if row.cells[name].lower() in MISSING else row.number(name)


def _with_force(row: ForceRow, force_n: float, std_n: float, rises_kpa: tuple[float, float]) -> ForceRow:
    """Return the contact with its force, and the reason if the force does not exist or is interpolated."""
    (lower_range_rise_kpa, largest_rise_kpa), rise_kpa = rises_kpa, row.final_kpa - row.baseline_kpa
    if rise_kpa > largest_rise_kpa:
        return row._replace(reason=flat_reason(largest_rise_kpa))
    if not math.isfinite(force_n + std_n):
        return row._replace(reason=NO_SOLUTION)
    low = rise_kpa < lower_range_rise_kpa
    return row._replace(
        force_n=force_n, force_std_n=std_n, reason=low_rise_reason(lower_range_rise_kpa) if low else ""
    )


def _budget(
    row: ForceRow, model: ForceModel, settings: ChainSettings, contact_s: float
) -> tuple[BudgetLine, ...]:
    pressures_kpa = row.baseline_kpa, row.final_kpa
    inputs, uncertainty = settings.input_uncertainties, settings.model_uncertainty
    return compute_budget(*pressures_kpa, model, settings.correction, inputs, uncertainty, contact_s)


def force_csv(rows: Sequence[ForceRow]) -> str:
    """Return the table as CSV: the columns of the input file, then the results.

    A cell is empty if its value is not available. With a budget, each source of uncertainty has a column with
    its part of the force [N].
    """
    sources = next(([line.source for line in row.budget] for row in rows if row.budget), [])
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    inputs = list(rows[0].cells) if rows else []
    results = [*RESULT_COLUMNS, *(f"{source} (N)" for source in sources)]
    writer.writerow([*(INPUT_PREFIX + name if name in results else name for name in inputs), *results])
    for row in rows:
        forces = [f"{value:.6g}" if row.valid else "" for value in (row.force_n, row.force_std_n)]
        parts = [f"{line.force_n:.6g}" for line in row.budget] or [""] * len(sources)
        writer.writerow([*row.cells.values(), *forces, int(row.valid), row.reason, *parts])
    return text.getvalue()


def force_facts(rows: Sequence[ForceRow]) -> list[dict[str, Any]]:
    """Return the table as JSON data, with null for a value that is not available.

    `columns` contains the cells of the other columns of the input file as texts.
    """
    pressures = {name for names in PRESSURE_COLUMNS for name in names}
    return [
        {
            "columns": {name: cell for name, cell in row.cells.items() if name not in pressures},
            "baseline_kpa": finite_or_none(row.baseline_kpa),
            "final_kpa": finite_or_none(row.final_kpa),
            "force_n": row.force_n if row.valid else None,
            "force_std_n": row.force_std_n if row.valid else None,
            "valid": row.valid,
            "reason": row.reason or None,
            **({"budget": [line._asdict() for line in row.budget]} if row.budget else {}),
        }
        for row in rows
    ]
