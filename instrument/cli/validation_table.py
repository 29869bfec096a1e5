"""The report of a validation as a table for people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from instrument.model.law import MethodName
from instrument.validation import paper
from instrument.validation.continuous import Continuous
from instrument.validation.peaks import GroupErrors, MethodErrors
from instrument.validation.report import Report

#: Ours / the paper's.
METHODS: Mapping[MethodName, str] = {"energetic": "energetic", "lulevich": "Lulevich", "shanahan": "Shanahan"}


def shown(report: Report, facts: Mapping[str, Any], note: str) -> RenderableType:
    """The whole report."""
    return Group(
        Text(", ".join(f"{name.replace('_', ' ')}: {_said(value)}" for name, value in facts.items())),
        _peaks(report.groups),
        Text("\n".join(_contacts(report))),
        _continuous(report.continuous),
        Text(note),
    )


def _peaks(groups: tuple[GroupErrors, ...]) -> Table:
    table = Table(
        title="peak force: mean absolute error [%], ours/the paper's", box=SIMPLE_HEAD, title_justify="left"
    )
    table.add_column("contacts by ΔP_i", no_wrap=True)
    for name in ("n", *METHODS.values(), "signed"):
        table.add_column(name, justify="right", no_wrap=True)
    for group in groups:
        errors = [group.by_method[method] for method in METHODS]
        cells = [_beside(error) for error in errors]
        table.add_row(group.name, str(group.contacts), *cells, _number(errors[0].signed_percent, "+.1f"))
    return table


def _beside(errors: MethodErrors) -> str:
    printed = errors.printed_percent
    return f"{_number(errors.absolute_percent, '.2f')}/{'–' if printed is None else f'{printed:.2f}':>5}"


def _contacts(report: Report) -> Iterator[str]:
    counts, change = report.counts, report.volume_change
    least, most, mean = paper.VOLUME_CHANGE
    yield "signed: mean error of the energetic method; – where the paper prints none"
    yield f"{counts.found} contacts in {report.trials} trials (the paper's: {paper.CONTACTS}), not evaluated:"
    yield f"  rise below 0.5 kPa, as in the paper: {counts.too_small}"
    yield f"  ΔP_i outside the validated range: {counts.out_of_range}"
    yield f"  not felt by the reference: {counts.without_force}"
    yield (
        f"ΔV/V_i above 8.85 kPa: {_number(change.least, '.3f')} to {_number(change.most, '.3f')}, "
        f"mean {_number(change.mean, '.3f')} (the paper's: {least} to {most}, mean {mean})"
    )


def _continuous(own: Continuous) -> Table:
    table = Table(
        title="continuous force: RMSE [N] in and around contacts", box=SIMPLE_HEAD, title_justify="left"
    )
    for name in ("force", "shift", "ours", "the paper's"):
        table.add_column(name, justify="left" if name == "force" else "right")
    table.add_row("lag compensated as it comes", "none", _number(own.compensated_n, ".3f"), "–")
    table.add_row("from the filtered pressure", "none", _number(own.uncompensated_n, ".3f"), "–")
    table.add_row(
        "the same, shifted afterwards",
        f"−{own.shift_s:.3f} s",
        _number(own.shifted_n, ".3f"),
        f"{paper.RMSE_N} (−{paper.SHIFT_S} s)",
    )
    table.caption = (
        f"{own.looked_at_s:.0f} s, of them {own.without_force_s:.0f} s without a force: ΔP_i out of range"
    )
    table.caption_justify = "left"
    return table


def _said(value: object) -> str:
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if math.isfinite(value) else "–"
