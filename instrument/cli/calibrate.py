"""`pneuforce calibrate`: fit measured points, print the result, and add it to a calibration file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import contacts as cell
from pneuforce.instrument.calibration import file, parts
from pneuforce.instrument.calibration import lag as lags
from pneuforce.instrument.calibration import radius as radii
from pneuforce.instrument.calibration import volume as volumes
from pneuforce.instrument.calibration.apply import apply_calibration, changed_conditions
from pneuforce.instrument.calibration.file import Calibration, CalibrationPart
from pneuforce.instrument.calibration.force import ForceCalibration, fit_force
from pneuforce.instrument.calibration.residuals import BinErrors, errors_by_pressure, force_residual
from pneuforce.instrument.config import Configuration, read
from pneuforce.instrument.measurement.chain import ChainSettings
from pneuforce.support.atomic_file import check_writable, read_file
from pneuforce.support.columns import Points, parse_points

#: Highest setpoint that the registers accept.
MAX_SETPOINT_KPA = 12.0


class CalibrationTarget(NamedTuple):
    """Calibration file to write, and configuration of the instrument."""

    out: Path | None
    config: Path | None


class CalibrationResult(NamedTuple):
    """One part of a calibration with the text about it."""

    part: CalibrationPart
    lines: list[str]  #: result of the fit
    notes: list[str]  #: warnings, and the file that was written

    def format(self, as_json: bool) -> str:
        """Return the result as text or as JSON."""
        if not as_json:
            return "\n".join(self.lines + [f"note: {note}" for note in self.notes])
        facts = self.part.model_dump(mode="json") | {"notes": self.notes}
        return json.dumps(facts, indent=2, ensure_ascii=False)


class _Instrument(NamedTuple):
    """Configuration and calibration of the instrument before the new part."""

    configuration: Configuration
    calibration: Calibration

    @classmethod
    def of(cls, target: CalibrationTarget) -> _Instrument:
        """Read both files. Raises ConfigurationError if the calibration file cannot be written later."""
        if target.out is not None:
            check_writable(target.out)
        configuration = read(target.config) if target.config else Configuration()
        if target.out is None or not target.out.exists():
            return cls(configuration, file.empty(configuration.balloon.id))
        return cls(configuration, file.load(target.out))

    @property
    def chain(self) -> ChainSettings:
        """Return the settings of the measuring chain without a force calibration.

        The force calibration is left out because a new part replaces it or does not depend on it.
        """
        calibration = self.calibration.model_copy(update={"force": None})
        return self.configuration.with_calibration(calibration).chain


def radius(data: Path, target: CalibrationTarget) -> CalibrationResult:
    """Fit the radius over the pressure, and save it. Raises ConfigurationError."""
    points, instrument = _points(data, radii.COLUMNS), _Instrument.of(target)
    found = radii.fit_radius(points)
    part = parts.radius_part(found, points, date.today())
    rest, linear, quadratic = found.quadratic.coefficients
    stds, rubber = found.quadratic.stds, found.rubber
    lines = [
        f"R_0         {rest:.3f} ± {stds[0]:.3f} mm",
        f"linear      {linear:.5f} ± {stds[1]:.5f} mm/kPa",
        f"quadratic   {quadratic:.6f} ± {stds[2]:.6f} mm/kPa²",
        f"residual    {found.quadratic.std:.3f} mm over {len(points)} points",
        f"rubber      limit point {rubber.limit_kpa:.2f} ± {rubber.limit_std_kpa:.2f} kPa "
        f"(neo-Hookean, residual {rubber.residual_mm:.3f} mm)",
    ]
    warning = rubber.limit_warning(MAX_SETPOINT_KPA)
    return _save("radius", CalibrationResult(part, lines, [warning] if warning else []), instrument, target)


def volume(
    data: Path | None, strokes_as_options: Sequence[list[float]], target: CalibrationTarget
) -> CalibrationResult:
    """Fit the volume V_c of the pipes, and save it. Raises ConfigurationError."""
    if (data is None) is not any(strokes_as_options):
        raise ConfigurationError(
            "give either a CSV file, or all of --displaced-ml, --before-kpa and --after-kpa"
        )
    if data is None:
        strokes = volumes.strokes_from_options(*strokes_as_options)
    else:
        strokes = volumes.read_strokes(_points(data, volumes.COLUMNS, volumes.OPTIONAL_COLUMNS))
    instrument = _Instrument.of(target)
    ambient_kpa = instrument.configuration.circuit.ambient_kpa
    found = volumes.fit_volume(strokes, ambient_kpa)
    part = parts.volume_part(found, strokes.points, ambient_kpa, date.today())
    lines = [
        f"V_c         {found.volume_mm3:.0f} ± {found.std_mm3:.0f} mm³ at {ambient_kpa:g} kPa ambient",
        f"residual    {found.residual_kpa:.3f} kPa over {len(strokes.points)} strokes",
    ]
    return _save("volume", CalibrationResult(part, lines, []), instrument, target)


def lag(data: Path, filter_time_constant_s: float, target: CalibrationTarget) -> CalibrationResult:
    """Fit the time constant of the tube, and save it. Raises ConfigurationError."""
    points, instrument = _points(data, lags.COLUMNS), _Instrument.of(target)
    found = lags.fit_lag(points, filter_time_constant_s)
    part = parts.lag_part(found, points, date.today())
    lines = [
        f"tube        {found.tube_time_constant_s:.4f} ± {found.std_s:.4f} s",
        f"residual    {found.residual_kpa:.3f} kPa of a step of {found.step_kpa:.2f} kPa",
    ]
    return _save("lag", CalibrationResult(part, lines, []), instrument, target)


def force(data: Path, target: CalibrationTarget) -> CalibrationResult:
    """Fit the force calibration, and save it.

    Raises ConfigurationError if the contacts do not support a calibration.
    """
    points, instrument = _points(data, cell.COLUMNS, cell.OPTIONAL_COLUMNS), _Instrument.of(target)
    settings = instrument.chain
    try:
        found = fit_force(cell.read_contacts(points, settings), settings)
    except ConfigurationError as error:
        raise error if str(error).startswith(points.name) else points.error(str(error)) from None
    by_pressure = errors_by_pressure(found.chosen.held_out_n, found.contacts)
    part = parts.force_part(found, by_pressure, points, settings, date.today())
    return _save("force", CalibrationResult(part, _format_force(found, by_pressure), []), instrument, target)


def _format_force(found: ForceCalibration, by_pressure: list[BinErrors]) -> list[str]:
    """Return the coefficients, and the errors before and after the calibration, as lines of text."""
    before = force_residual(found.contacts.law_n, found.contacts)
    after = force_residual(found.chosen.held_out_n, found.contacts)
    coefficients = [
        f"{term:<12}{value:+.4f} ± {std:.4f}"
        for term, value, std in zip(found.chosen.terms, found.fit.coefficients, found.fit.stds, strict=True)
    ]
    return [
        *coefficients,
        f"{'contacts':<28}{'bare law':>10}{'calibrated':>12}   (each contact held out of the fit)",
        _row("1 to 3.5 N, mean error", before.mean_error_percent, after.mean_error_percent, ".1f", "%"),
        _row("below 1 N, rms", before.rmse_n, after.rmse_n, ".3f", "N"),
        *(
            _row(
                f"{b.low_kpa:.2f}–{b.high_kpa:.2f} kPa ({b.contacts})",
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


def _row(label: str, before: float, after: float, form: str, unit: str) -> str:
    return f"{label:<28}{before:>8{form}} {unit}{after:>10{form}} {unit}"


def _points(data: Path, columns: Sequence[Sequence[str]], optional: Sequence[str] = ()) -> Points:
    return parse_points(read_file(data), str(data), columns, optional)


def _save(
    name: str, result: CalibrationResult, instrument: _Instrument, target: CalibrationTarget
) -> CalibrationResult:
    """Add the part to the calibration file, if there is one, and return the result with notes.

    A force calibration that was made with other values of this part is removed from the file.
    """
    calibration = instrument.calibration.model_copy(update={name: result.part})
    without_force = calibration.model_copy(update={"force": None})
    settings = instrument.configuration.with_calibration(without_force).chain
    notes = list(result.notes)
    if calibration.force and changed_conditions(settings, calibration.force):
        calibration = without_force
        notes.append(
            "the force calibration in this file was made with the old value and was removed: calibrate again"
        )
    apply_calibration(instrument.configuration.chain, calibration)
    if target.out is None:
        return result._replace(
            notes=[*notes, "nothing was written: use --out calibration.toml to save the result"]
        )
    file.save(calibration, target.out)
    return result._replace(notes=[*notes, f"written to {target.out}"])
