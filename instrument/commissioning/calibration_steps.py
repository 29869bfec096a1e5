"""Steps of the calibration: fit measured points, and add the result to a calibration file."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration import contacts, file, parts
from pneuforce.instrument.calibration import grip as grips
from pneuforce.instrument.calibration import lag as lags
from pneuforce.instrument.calibration import radius as radii
from pneuforce.instrument.calibration import volume as volumes
from pneuforce.instrument.calibration.apply import (
    apply_calibration,
    changed_conditions,
    changed_grip_conditions,
)
from pneuforce.instrument.calibration.clipped_contacts import clipped_contacts_warning
from pneuforce.instrument.calibration.file import Calibration
from pneuforce.instrument.calibration.force import ForceCalibration, fit_force
from pneuforce.instrument.calibration.force_gap import force_gap_warning
from pneuforce.instrument.calibration.grip import GripFit
from pneuforce.instrument.calibration.lag import LagFit
from pneuforce.instrument.calibration.plausibility import warnings_about
from pneuforce.instrument.calibration.radius import RadiusFit
from pneuforce.instrument.calibration.reference_zero import apparent_zero_warning
from pneuforce.instrument.calibration.residuals import (
    ContactResidual,
    contact_residuals,
    errors_by_pressure,
)
from pneuforce.instrument.calibration.sections import (
    CalibrationPart,
    ForcePart,
    GripPart,
    LagPart,
    RadiusPart,
    VolumePart,
)
from pneuforce.instrument.calibration.volume import VolumeFit
from pneuforce.instrument.commissioning.previous_calibration import CalibrationTarget, PreviousCalibration
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.force_tables import ProgressCallback, force_table
from pneuforce.instrument.signing.signed_file import SignatureState, read_signed
from pneuforce.instrument.signing.trusted_keys import NO_TRUSTED_KEYS
from pneuforce.support.atomic_file import read_file
from pneuforce.support.columns import Points, parse_points

#: Highest setpoint that the registers accept.
MAX_SETPOINT_KPA = 12.0

Part = TypeVar("Part", bound=CalibrationPart)
Fit = TypeVar("Fit")


class CalibrationStep(NamedTuple, Generic[Part, Fit]):
    """Result of one step."""

    part: Part  #: part of the calibration file
    fit: Fit
    point_count: int
    notes: list[str]  #: messages for the user: warnings, and the name of the written file


def calibrate_radius(data: Path, target: CalibrationTarget) -> CalibrationStep[RadiusPart, RadiusFit]:
    """Fit the radius over the pressure, and save it. Raises ConfigurationError."""
    points, previous = _points(data, radii.COLUMNS), PreviousCalibration.of(target)
    found = radii.fit_radius(points)
    part = parts.radius_part(found, points, date.today())
    warnings = found.extrapolation_warning, found.rubber.limit_warning(MAX_SETPOINT_KPA)
    notes = [warning for warning in warnings if warning]
    return CalibrationStep(part, found, len(points), notes + _save("radius", part, previous, target))


def calibrate_volume(
    data: Path | None, strokes_as_options: Sequence[list[float]], target: CalibrationTarget
) -> CalibrationStep[VolumePart, VolumeFit]:
    """Fit the volume V_c of the tubes, and save it. Raises ConfigurationError."""
    if (data is None) is not any(strokes_as_options):
        raise ConfigurationError(
            "give either a CSV file, or all of --displaced-ml, --before-kpa and --after-kpa"
        )
    if data is None:
        strokes = volumes.strokes_from_options(*strokes_as_options)
    else:
        strokes = volumes.read_strokes(_points(data, volumes.COLUMNS, volumes.OPTIONAL_COLUMNS))
    previous = PreviousCalibration.of(target)
    ambient_kpa = previous.configuration.circuit.ambient_kpa
    found = volumes.fit_volume(strokes, ambient_kpa)
    part = parts.volume_part(found, strokes.points, ambient_kpa, date.today())
    return CalibrationStep(part, found, len(strokes.points), _save("volume", part, previous, target))


def calibrate_lag(
    data: Path, filter_time_constant_s: float, target: CalibrationTarget
) -> CalibrationStep[LagPart, LagFit]:
    """Fit the time constant of the tube, and save it. Raises ConfigurationError."""
    points, previous = _points(data, lags.COLUMNS), PreviousCalibration.of(target)
    found = lags.fit_lag(points, filter_time_constant_s)
    part = parts.lag_part(found, points, date.today())
    return CalibrationStep(part, found, len(points), _save("lag", part, previous, target))


def calibrate_grip(
    data: Path | None,
    weights_as_options: Sequence[list[float]],
    target: CalibrationTarget,
    progress: ProgressCallback,
) -> CalibrationStep[GripPart, GripFit]:
    """Fit the grip to known weights, and save it. Raises ConfigurationError.

    `progress(done, total)` is called while the force table of the balloon is computed.
    """
    if (data is None) is not any(weights_as_options):
        raise ConfigurationError("give either a CSV file, or all of --mass-g, --before-kpa and --after-kpa")
    options = weights_as_options
    points = grips.weights_from_options(*options) if data is None else _points(data, grips.COLUMNS)
    previous = PreviousCalibration.of(target)
    settings = previous.for_grip
    force_table(settings.balloon, settings.circuit, settings.law.sides, progress)
    found = grips.fit_grip(points, settings)
    part = parts.grip_part(found, points, settings, date.today())
    notes = _save("grip", part, previous, target)
    if previous.configuration.measurement.method != "membrane":
        notes.append('the grip takes effect with measurement.method = "membrane" in instrument.toml')
    return CalibrationStep(part, found, len(points), notes)


def calibrate_force(
    data: Path, target: CalibrationTarget
) -> tuple[CalibrationStep[ForcePart, ForceCalibration], list[ContactResidual]]:
    """Fit the force calibration, and save it. Return the step, and the residual of each contact.

    Raises ConfigurationError if the contacts do not support a calibration, or have no reference force.
    """
    table = contacts.parse_contacts(read_file(data), str(data))
    previous = PreviousCalibration.of(target)
    settings = previous.chain
    points, unsolved_lines = contacts.select_solved(table, settings)
    unused = _unsolved_notes(unsolved_lines)
    try:
        found = fit_force(contacts.read_contacts(points, settings), settings)
    except ConfigurationError as error:
        reasons = "; ".join([str(error).removeprefix(f"{points.name}: "), *unused])
        raise points.error(reasons) from None
    by_pressure = errors_by_pressure(found.chosen.held_out_n, found.contacts)
    part = parts.force_part(found, by_pressure, points, settings, date.today())
    warnings = [
        apparent_zero_warning(found),
        force_gap_warning(found.contacts.force_n),
        clipped_contacts_warning(found.contacts),
    ]
    notes = [*unused, *filter(None, warnings), *_save("force", part, previous, target)]
    residuals = contact_residuals(found.chosen.held_out_n, found.contacts, points.lines)
    return CalibrationStep(part, found, len(points), notes), residuals


def _unsolved_notes(lines: Sequence[int]) -> list[str]:
    """Return a note with the lines of the contacts for which the force law has no solution."""
    if not lines:
        return []
    where = ", ".join(map(str, lines))
    return [f"the force law has no solution for the contacts in these lines, which were not used: {where}"]


def _points(data: Path, columns: Sequence[Sequence[str]], optional: Sequence[str] = ()) -> Points:
    return parse_points(read_file(data), str(data), columns, optional)


def _save(
    name: str, part: CalibrationPart, previous: PreviousCalibration, target: CalibrationTarget
) -> list[str]:
    """Add the part to the file `target.out`, if a file is given. Return notes for the user.

    A force calibration that was made with other values of this part is removed.
    """
    notes = [*previous.notes]
    calibration = previous.calibration.model_copy(update={name: part})
    without_force = calibration.model_copy(update={"force": None, "grip": None})
    settings = previous.configuration.with_calibration(without_force).chain
    if calibration.grip and changed_grip_conditions(settings, calibration.grip):
        calibration = calibration.model_copy(update={"grip": None})
        notes.append(
            "the old grip was calibrated with the old value and was removed: calibrate the grip again"
        )
    without_force = calibration.model_copy(update={"force": None})
    settings = previous.configuration.with_calibration(without_force).chain
    if calibration.force and changed_conditions(settings, calibration.force):
        calibration = without_force
        notes.append(
            "the old force calibration was made with the old value and was removed: calibrate the force again"
        )
    settings = _applied(calibration, part, previous)
    notes += warnings_about(calibration, settings, date.today())
    if target.out is None:
        return [*notes, "nothing was written: use --out calibration.toml to save the result"]
    file.save(calibration, target.out)
    old = getattr(previous.calibration, name)
    replaced = f"; it replaces the {name} calibration of {old.date}" if old else ""
    return [*notes, *_signature_note(target.out), f"written to {target.out}{replaced}"]


def _signature_note(file: Path) -> list[str]:
    if read_signed(file, NO_TRUSTED_KEYS).signature.state is not SignatureState.ALTERED:
        return []
    return [
        f"the signature of {file} is no longer valid: sign the file again with pneuforce sign file {file}"
    ]


def _applied(calibration: Calibration, part: CalibrationPart, previous: PreviousCalibration) -> ChainSettings:
    """Return the settings of the measuring chain with a calibration that contains the new part.

    Raises ConfigurationError, which names the file of a value that is wrong.
    """
    try:
        return apply_calibration(previous.configuration.chain, calibration)
    except ConfigurationError as error:
        is_new = calibration.force is None or calibration.force is part
        name = part.source if is_new else previous.source
        raise ConfigurationError(f"{name}: {error}; nothing was written") from None
