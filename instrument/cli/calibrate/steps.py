"""`pneuforce calibrate`: run a step of the calibration, and format its result as text or as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from pneuforce.instrument.calibration.force import ForceCalibration
from pneuforce.instrument.calibration.residuals import ContactResidual, errors_by_pressure, force_residual
from pneuforce.instrument.cli.terminal.output import done_json, progress
from pneuforce.instrument.commissioning.calibration_steps import (
    CalibrationStep,
    calibrate_force,
    calibrate_grip,
    calibrate_lag,
    calibrate_radius,
    calibrate_volume,
)
from pneuforce.instrument.commissioning.previous_calibration import CalibrationTarget
from pneuforce.instrument.recording.table_export import csv_lines
from pneuforce.support.atomic_file import check_new, write_lines
from pneuforce.support.counted import counted
from pneuforce.support.printable import printable

SHOWN_RESIDUALS = 3  #: number of residuals that are shown on the terminal


class ResidualFile(NamedTuple):
    """CSV file for the residuals of all contacts; no file if `file` is None."""

    file: Path | None
    overwrite: bool


def radius(data: Path, target: CalibrationTarget, as_json: bool) -> str:
    """Calibrate the radius. Return the coefficients, the residual and the limit point as text."""
    step = calibrate_radius(data, target)
    rest, linear, quadratic = step.fit.quadratic.coefficients
    stds, rubber = step.fit.quadratic.stds, step.fit.rubber
    lines = [
        f"R_0         {rest:.3f} ± {stds[0]:.3f} mm",
        f"linear      {linear:.5f} ± {stds[1]:.5f} mm/kPa",
        f"quadratic   {quadratic:.6f} ± {stds[2]:.6f} mm/kPa²",
        f"residual    {step.fit.quadratic.std:.3f} mm over {counted(step.point_count, 'point')}",
        f"rubber      limit point {rubber.limit_kpa:.2f} ± {rubber.limit_std_kpa:.2f} kPa "
        f"(neo-Hookean, residual {rubber.residual_mm:.3f} mm)",
    ]
    return _format_step("radius", step, lines, as_json)


def volume(
    data: Path | None, strokes: Sequence[list[float]], target: CalibrationTarget, as_json: bool
) -> str:
    """Calibrate the volume of the tubes. Return the volume and the residual as text."""
    step = calibrate_volume(data, strokes, target)
    ambient_kpa = step.part.ambient_kpa
    lines = [
        f"V_c         {step.fit.volume_mm3:.0f} ± {step.fit.std_mm3:.0f} mm³ at {ambient_kpa:g} kPa ambient",
        f"residual    {step.fit.residual_kpa:.3f} kPa over {counted(step.point_count, 'stroke')}",
    ]
    return _format_step("volume", step, lines, as_json)


def lag(data: Path, filter_time_constant_s: float, target: CalibrationTarget, as_json: bool) -> str:
    """Calibrate the lag of the tube. Return the time constant and the residual as text."""
    step = calibrate_lag(data, filter_time_constant_s, target)
    lines = [
        f"tube        {step.fit.tube_time_constant_s:.4f} ± {step.fit.std_s:.4f} s",
        f"residual    {step.fit.residual_kpa:.3f} kPa of a step of {step.fit.step_kpa:.2f} kPa",
    ]
    return _format_step("lag", step, lines, as_json)


def grip(data: Path | None, weights: Sequence[list[float]], target: CalibrationTarget, as_json: bool) -> str:
    """Calibrate the grip with known weights. Return the grip of each weight, and the mean, as text."""
    with progress("force table of the balloon") as report:
        step = calibrate_grip(data, weights, target, report)
    lines = [f"grip        {step.fit.grip:.2f} ± {step.fit.std:.2f} (0: the skin slides, 1: it sticks)"]
    lines += [
        f"weight      {force_n:.3f} N, grip {each:.2f}"
        for force_n, each in zip(step.fit.force_n, step.fit.each, strict=True)
    ]
    return _format_step("grip", step, lines, as_json)


def force(data: Path, target: CalibrationTarget, residuals: ResidualFile, as_json: bool) -> str:
    """Calibrate the force, and write the residuals if a file is given.

    Return the coefficients, the errors before and after, and the largest residuals as text.
    """
    if residuals.file is not None:
        check_new(residuals.file, residuals.overwrite)
    step, rows = calibrate_force(data, target)
    if residuals.file is not None:
        write_lines(residuals.file, csv_lines(rows, ContactResidual._fields))
    lines = [*_format_force(step.fit), *_format_residuals(rows)]
    return _format_step("force", step, lines, as_json, {"residuals": [row._asdict() for row in rows]})


def _format_step(
    quantity: str,
    step: CalibrationStep[Any, Any],
    lines: list[str],
    as_json: bool,
    more_facts: Mapping[str, Any] = MappingProxyType({}),
) -> str:
    """Return the lines and the notes of a step as text, or its part of the calibration file as JSON."""
    if not as_json:
        return "\n".join(lines + [f"note: {printable(note)}" for note in step.notes])
    facts = step.part.model_dump(mode="json") | more_facts | {"notes": step.notes}
    message = "; ".join([f"the {quantity} is calibrated", *step.notes])
    return done_json(message, **facts)


def _format_force(found: ForceCalibration) -> list[str]:
    """Return the coefficients, and the errors before and after the calibration, as lines of text."""
    by_pressure = errors_by_pressure(found.chosen.held_out_n, found.contacts)
    before = force_residual(found.contacts.law_n, found.contacts)
    after = force_residual(found.chosen.held_out_n, found.contacts)
    coefficients = [
        f"{term:<12}{value:+.4f} ± {std:.4f}"
        for term, value, std in zip(found.chosen.terms, found.fit.coefficients, found.fit.stds, strict=True)
    ]
    return [
        *coefficients,
        f"{'contacts':<28}{'uncalibrated':>12}{'calibrated':>12}   (each contact held out of the fit)",
        _row("1 to 3.5 N, mean error", before.mean_error_percent, after.mean_error_percent, ".1f", "%"),
        _row("below 1 N, rms", before.rmse_n, after.rmse_n, ".3f", "N"),
        "1 to 3.5 N by ΔP_i, mean error (number of these contacts)",
        *(
            _row(
                f"  {b.low_kpa:.2f}–{b.high_kpa:.2f} kPa ({b.contacts})",
                b.before_percent,
                b.after_percent,
                ".1f",
                "%",
            )
            for b in by_pressure
        ),
        "terms tried: "
        + ", ".join(f"{len(c.terms)} → {100 * c.error:.1f} %" for c in found.candidates)
        + f"; chosen: {len(found.chosen.terms)}",
    ]


def _format_residuals(rows: Sequence[ContactResidual]) -> list[str]:
    """Return the largest residuals as lines of text."""
    largest = sorted(rows, key=lambda row: row.ratio, reverse=True)[:SHOWN_RESIDUALS]
    return ["largest differences from the reference (--residuals writes all):"] + [
        f"  line {row.line:<4} ΔP_i {row.baseline_kpa:6.3f} kPa, rise {row.rise_kpa:6.3f} kPa: reference "
        f"{row.reference_n:.3f} N, estimate {row.estimate_n:.3f} N, difference {row.difference_n:+.3f} N "
        f"= {row.ratio:.1f} u"
        for row in largest
    ]


def _row(label: str, before: float, after: float, form: str, unit: str) -> str:
    return f"{label:<28}{before:>10{form}} {unit}{after:>10{form}} {unit}"
