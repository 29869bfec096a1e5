"""What `pneuforce calibrate` does: reads points, fits them, adds the part to a calibration file, tells it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import NamedTuple

from instrument.calibration import contacts as cell
from instrument.calibration import file, parts
from instrument.calibration import lag as lags
from instrument.calibration import radius as radii
from instrument.calibration import volume as volumes
from instrument.calibration.applied import calibrated, stale
from instrument.calibration.file import Calibration, Part
from instrument.calibration.force import ForceCalibration, calibration_of
from instrument.calibration.residuals import Bin, bins, residual_of
from instrument.chain import ChainSettings
from instrument.columns import Points, points_in
from instrument.config import Configuration, read
from instrument.errors import ConfigurationError
from instrument.whole_file import check_writable, content_of

#: The highest setpoint that the registers accept [kPa].
HIGHEST_SETPOINT_KPA = 12.0


class Target(NamedTuple):
    """Where a part goes, and what instrument it is of."""

    out: Path | None
    config: Path | None


class Result(NamedTuple):
    """One part of a calibration, and what to tell of it."""

    part: Part
    lines: list[str]
    notes: list[str]

    def told(self, as_json: bool) -> str:
        """As text, or as JSON."""
        if not as_json:
            return "\n".join(self.lines + [f"note: {note}" for note in self.notes])
        answer = self.part.model_dump(mode="json") | {"notes": self.notes}
        return json.dumps(answer, indent=2, ensure_ascii=False)


class _Bench(NamedTuple):
    """The instrument as known before the new part."""

    configuration: Configuration
    calibration: Calibration

    @classmethod
    def of(cls, target: Target) -> _Bench:
        if target.out is not None:
            check_writable(target.out)
        configuration = read(target.config) if target.config else Configuration()
        if target.out is None or not target.out.exists():
            return cls(configuration, file.empty(configuration.balloon.id))
        return cls(configuration, file.load(target.out))

    @property
    def chain(self) -> ChainSettings:
        """Without a force calibration: it is made anew, or of no account."""
        return self.configuration.calibrated_by(self.calibration.model_copy(update={"force": None})).chain


def radius(data: Path, target: Target) -> Result:
    """Fit, tell and keep the radius. Raises ConfigurationError."""
    points, bench = _points(data, radii.COLUMNS), _Bench.of(target)
    found = radii.radius_of(points)
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
    warning = rubber.warning(HIGHEST_SETPOINT_KPA)
    return _keep("radius", Result(part, lines, [warning] if warning else []), bench, target)


def volume(data: Path | None, typed: Sequence[list[float]], target: Target) -> Result:
    """Fit, tell and keep V_c. Raises ConfigurationError."""
    if (data is None) is not any(typed):
        raise ConfigurationError("give either a CSV file, or --displaced-ml, --before-kpa and --after-kpa")
    if data is None:
        strokes = volumes.strokes_typed(*typed)
    else:
        strokes = volumes.strokes_in(_points(data, volumes.COLUMNS, volumes.ALSO))
    bench = _Bench.of(target)
    ambient_kpa = bench.configuration.circuit.ambient_kpa
    found = volumes.volume_of(strokes, ambient_kpa)
    part = parts.volume_part(found, strokes.points, ambient_kpa, date.today())
    lines = [
        f"V_c         {found.volume_mm3:.0f} ± {found.std_mm3:.0f} mm³ at {ambient_kpa:g} kPa ambient",
        f"residual    {found.residual_kpa:.3f} kPa over {len(strokes.points)} strokes",
    ]
    return _keep("volume", Result(part, lines, []), bench, target)


def lag(data: Path, filter_s: float, target: Target) -> Result:
    """Fit, tell and keep the lag of the tube. Raises ConfigurationError."""
    points, bench = _points(data, lags.COLUMNS), _Bench.of(target)
    found = lags.lag_of(points, filter_s)
    part = parts.lag_part(found, points, date.today())
    lines = [
        f"tube        {found.tube_s:.4f} ± {found.std_s:.4f} s",
        f"residual    {found.residual_kpa:.3f} kPa of a step of {found.step_kpa:.2f} kPa",
    ]
    return _keep("lag", Result(part, lines, []), bench, target)


def force(data: Path, target: Target) -> Result:
    """Fit, tell and keep the force calibration. Raises ConfigurationError where it is none."""
    points, bench = _points(data, cell.COLUMNS, cell.ALSO), _Bench.of(target)
    own = bench.chain
    try:
        found = calibration_of(cell.contacts_in(points, own), own)
    except ConfigurationError as error:
        raise error if str(error).startswith(points.name) else points.refusal(str(error)) from None
    by_pressure = bins(found.chosen.unseen_n, found.contacts)
    part = parts.force_part(found, by_pressure, points, own, date.today())
    return _keep("force", Result(part, _told_of_force(found, by_pressure), []), bench, target)


def _told_of_force(found: ForceCalibration, by_pressure: list[Bin]) -> list[str]:
    before = residual_of(found.contacts.law_n, found.contacts)
    after = residual_of(found.chosen.unseen_n, found.contacts)
    chosen = [
        f"{term:<12}{value:+.4f} ± {std:.4f}"
        for term, value, std in zip(found.chosen.terms, found.fit.coefficients, found.fit.stds, strict=True)
    ]
    return [
        *chosen,
        f"{'contacts':<28}{'bare law':>10}{'calibrated':>12}   (each contact by a fit without it)",
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
        + f"; taken: {len(found.chosen.terms)}",
    ]


def _row(what: str, before: float, after: float, form: str, unit: str) -> str:
    return f"{what:<28}{before:>8{form}} {unit}{after:>10{form}} {unit}"


def _points(data: Path, choices: Sequence[Sequence[str]], also: Sequence[str] = ()) -> Points:
    return points_in(content_of(data), str(data), choices, also)


def _keep(name: str, result: Result, bench: _Bench, target: Target) -> Result:
    """Add the part to the file, where there is one. A force calibration that it makes untrue is dropped."""
    calibration = bench.calibration.model_copy(update={name: result.part})
    without_force = calibration.model_copy(update={"force": None})
    own = bench.configuration.calibrated_by(without_force).chain
    notes = list(result.notes)
    if calibration.force and stale(own, calibration.force):
        calibration = without_force
        notes.append(
            "the force calibration in this file was made with the old value, and is dropped: make it anew"
        )
    calibrated(bench.configuration.chain, calibration)
    if target.out is None:
        return result._replace(notes=[*notes, "nothing was written: --out calibration.toml keeps it"])
    file.save(calibration, target.out)
    return result._replace(notes=[*notes, f"written to {target.out}"])
