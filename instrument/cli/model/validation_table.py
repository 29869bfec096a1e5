"""Validation report as tables and text for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from pneuforce.instrument.model.law import PublishedMethod
from pneuforce.instrument.validation import paper
from pneuforce.instrument.validation.continuous import ContinuousErrors
from pneuforce.instrument.validation.instrument_errors import InstrumentErrors
from pneuforce.instrument.validation.peaks import GroupErrors, MethodErrors
from pneuforce.instrument.validation.report import ValidationReport
from pneuforce.support.counted import counted
from pneuforce.support.printable import printable

METHOD_TITLES: Mapping[PublishedMethod, str] = {
    "energetic": "energetic",
    "lulevich": "Lulevich",
    "shanahan": "Shanahan",
}


def render_report(report: ValidationReport, facts: Mapping[str, Any], note: str) -> RenderableType:
    """Return the report, with the facts about its source before the tables and the note after them."""
    return Group(
        Text(printable(_format_facts(facts))),
        *([_instrument_table(report.instrument)] if report.instrument else []),
        _peak_table(report.groups),
        Text("\n".join(_contact_lines(report))),
        _continuous_table(report.continuous),
        Text(note),
    )


def _instrument_table(errors_by_group: tuple[InstrumentErrors, ...]) -> Table:
    table = Table(
        title="peak force of the instrument, with its calibration (peaks without lag)",
        box=SIMPLE_HEAD,
        title_justify="left",
    )
    table.add_column("contacts by ΔP_i", no_wrap=True)
    for name in ("n", "error %", "signed %", "RMSE N", "in ±u %", "in ±2u %"):
        table.add_column(name, justify="right", no_wrap=True)
    for errors in errors_by_group:
        table.add_row(
            errors.group,
            str(errors.solved),
            _format_number(errors.absolute, ".2f"),
            _format_number(errors.signed, "+.1f"),
            _format_number(errors.rmse_n, ".3f"),
            _format_number(errors.within_u_percent, ".0f"),
            _format_number(errors.within_2u_percent, ".0f"),
        )
    return table


def _peak_table(groups: tuple[GroupErrors, ...]) -> Table:
    table = Table(
        title="peak force: mean absolute error [%], measured/paper", box=SIMPLE_HEAD, title_justify="left"
    )
    table.add_column("contacts by ΔP_i", no_wrap=True)
    for name in ("n", *METHOD_TITLES.values(), "signed"):
        table.add_column(name, justify="right", no_wrap=True)
    for group in groups:
        errors = [group.by_method[method] for method in METHOD_TITLES]
        cells = [_format_errors(error) for error in errors]
        signed = _format_number(errors[0].signed_percent, "+.1f")
        table.add_row(group.name, str(group.contacts), *cells, signed)
    return table


def _format_errors(errors: MethodErrors) -> str:
    """Return the measured error and the published error, for example "9.02/ 9.14"."""
    published = "–" if errors.published_percent is None else f"{errors.published_percent:.2f}"
    return f"{_format_number(errors.absolute_percent, '.2f')}/{published:>5}"


def _contact_lines(report: ValidationReport) -> Iterator[str]:
    counts, change = report.counts, report.volume_change
    low, high, mean = paper.VOLUME_CHANGE
    yield "signed: mean error of the energetic method; –: the paper gives no value"
    found = f"{counted(counts.found, 'contact')} in {counted(report.trials, 'trial')}"
    yield f"{found} (paper: {paper.CONTACT_COUNT}), not evaluated:"
    yield f"  pressed since the start of the trial (cut): {counts.cut}"
    yield f"  rise below 0.5 kPa, as in the paper: {counts.too_small}"
    yield f"  ΔP_i outside the validated range: {counts.out_of_range}"
    yield f"  no force measured by the reference: {counts.without_force}"
    yield (
        f"ΔV/V_i above 8.85 kPa: {_format_number(change.min, '.3f')} to {_format_number(change.max, '.3f')}, "
        f"mean {_format_number(change.mean, '.3f')} (paper: {low} to {high}, mean {mean})"
    )


def _continuous_table(errors: ContinuousErrors) -> Table:
    table = Table(
        title="continuous force: RMSE [N] in and around contacts", box=SIMPLE_HEAD, title_justify="left"
    )
    for name in ("force", "shift", "measured", "paper"):
        table.add_column(name, justify="left" if name == "force" else "right")
    table.add_row("with live lag compensation", "none", _format_number(errors.compensated_n, ".3f"), "–")
    table.add_row("from the filtered pressure", "none", _format_number(errors.uncompensated_n, ".3f"), "–")
    table.add_row(
        "the same, shifted afterwards",
        f"−{errors.shift_s:.3f} s",
        _format_number(errors.shifted_n, ".3f"),
        f"{paper.RMSE_N} (−{paper.SHIFT_S} s)",
    )
    table.caption = (
        f"{errors.evaluated_s:.0f} s evaluated, {errors.without_force_s:.0f} s of them without a force "
        "(ΔP_i out of range)"
    )
    table.caption_justify = "left"
    return table


def _format_facts(facts: Mapping[str, Any]) -> str:
    return ", ".join(f"{name.replace('_', ' ')}: {_format_fact(value)}" for name, value in facts.items())


def _format_fact(value: object) -> str:
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)


def _format_number(value: float, specification: str) -> str:
    return f"{value:{specification}}" if math.isfinite(value) else "–"
