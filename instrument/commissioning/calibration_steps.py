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
from pneuforce.instrument.calibration.file import Calibration
from pneuforce.instrument.calibration.force import ForceCalibration, fit_force
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
from pneuforce.instrument.config import Configuration, read
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.force_tables import ProgressCallback, force_table
from pneuforce.instrument.signing.signed_file import SignatureState, read_signed
from pneuforce.instrument.signing.trusted_keys import NO_TRUSTED_KEYS
from pneuforce.support.atomic_file import check_writable, read_file
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


class CalibrationTarget(NamedTuple):
    """Calibration file to write, and configuration of the instrument."""

    out: Path | None
    config: Path | None


class _Instrument(NamedTuple):
    """Configuration and calibration of the instrument before the new part is added."""

    configuration: Configuration
    calibration: Calibration

    @classmethod
    def of(cls, target: CalibrationTarget) -> _Instrument:
        """Read both files. Raises ConfigurationError if a file is invalid or `target.out` is not writable."""
        if target.out is not None:
            check_writable(target.out)
        configuration = read(target.config) if target.config else Configuration()
        if target.out is None or not target.out.exists():
            return cls(configuration, file.empty(configuration.balloon.id))
        return cls(configuration, file.load(target.out))

    @property
    def chain(self) -> ChainSettings:
        """Return the settings of the measuring chain without a force calibration.

        A new force calibration is fitted to the uncorrected force. The other parts do not depend on it.
        """
        calibration = self.calibration.model_copy(update={"force": None})
        return self.configuration.with_calibration(calibration).chain

    @property
    def for_grip(self) -> ChainSettings:
        """Return the settings with method "membrane", without a calibrated grip."""
        measurement = self.configuration.measurement.model_copy(update={"method": "membrane"})
        configuration = self.configuration.model_copy(update={"measurement": measurement})
        calibration = self.calibration.model_copy(update={"force": None, "grip": None})
        return configuration.with_calibration(calibration).chain


def calibrate_radius(data: Path, target: CalibrationTarget) -> CalibrationStep[RadiusPart, RadiusFit]:
    """Fit the radius over the pressure, and save it. Raises ConfigurationError."""
    points, instrument = _points(data, radii.COLUMNS), _Instrument.of(target)
    found = radii.fit_radius(points)
    part = parts.radius_part(found, points, date.today())
    warning = found.rubber.limit_warning(MAX_SETPOINT_KPA)
    notes = [warning] if warning else []
    return CalibrationStep(part, found, len(points), notes + _save("radius", part, instrument, target))


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
    instrument = _Instrument.of(target)
    ambient_kpa = instrument.configuration.circuit.ambient_kpa
    found = volumes.fit_volume(strokes, ambient_kpa)
    part = parts.volume_part(found, strokes.points, ambient_kpa, date.today())
    return CalibrationStep(part, found, len(strokes.points), _save("volume", part, instrument, target))


def calibrate_lag(
    data: Path, filter_time_constant_s: float, target: CalibrationTarget
) -> CalibrationStep[LagPart, LagFit]:
    """Fit the time constant of the tube, and save it. Raises ConfigurationError."""
    points, instrument = _points(data, lags.COLUMNS), _Instrument.of(target)
    found = lags.fit_lag(points, filter_time_constant_s)
    part = parts.lag_part(found, points, date.today())
    return CalibrationStep(part, found, len(points), _save("lag", part, instrument, target))


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
    instrument = _Instrument.of(target)
    settings = instrument.for_grip
    force_table(settings.balloon, settings.circuit, settings.law.sides, progress)
    found = grips.fit_grip(points, settings)
    part = parts.grip_part(found, points, settings, date.today())
    notes = _save("grip", part, instrument, target)
    if instrument.configuration.measurement.method != "membrane":
        notes.append('the grip takes effect with measurement.method = "membrane" in instrument.toml')
    return CalibrationStep(part, found, len(points), notes)


def calibrate_force(
    data: Path, target: CalibrationTarget
) -> tuple[CalibrationStep[ForcePart, ForceCalibration], list[ContactResidual]]:
    """Fit the force calibration, and save it. Return the step, and the residual of each contact.

    Raises ConfigurationError if the contacts do not support a calibration, or have no reference force.
    """
    points = contacts.parse_contacts(read_file(data), str(data))
    instrument = _Instrument.of(target)
    settings = instrument.chain
    try:
        found = fit_force(contacts.read_contacts(points, settings), settings)
    except ConfigurationError as error:
        raise error if str(error).startswith(points.name) else points.error(str(error)) from None
    by_pressure = errors_by_pressure(found.chosen.held_out_n, found.contacts)
    part = parts.force_part(found, by_pressure, points, settings, date.today())
    warning = apparent_zero_warning(found)
    notes = ([warning] if warning else []) + _save("force", part, instrument, target)
    residuals = contact_residuals(found.chosen.held_out_n, found.contacts, points.lines)
    return CalibrationStep(part, found, len(points), notes), residuals


def _points(data: Path, columns: Sequence[Sequence[str]], optional: Sequence[str] = ()) -> Points:
    return parse_points(read_file(data), str(data), columns, optional)


def _save(name: str, part: CalibrationPart, instrument: _Instrument, target: CalibrationTarget) -> list[str]:
    """Add the part to the file `target.out`, if a file is given. Return notes for the user.

    If the file has a force calibration that was made with other values of this part, it is removed.
    """
    notes = []
    calibration = instrument.calibration.model_copy(update={name: part})
    without_force = calibration.model_copy(update={"force": None, "grip": None})
    settings = instrument.configuration.with_calibration(without_force).chain
    if calibration.grip and changed_grip_conditions(settings, calibration.grip):
        calibration = calibration.model_copy(update={"grip": None})
        notes.append(
            "the grip in this file was calibrated with the old value and was removed: calibrate the grip "
            "again"
        )
    without_force = calibration.model_copy(update={"force": None})
    settings = instrument.configuration.with_calibration(without_force).chain
    if calibration.force and changed_conditions(settings, calibration.force):
        calibration = without_force
        notes.append(
            "the force calibration in this file was made with the old value and was removed: "
            "calibrate the force again"
        )
    settings = _applied(instrument.configuration, calibration, part, target)
    notes += warnings_about(calibration, settings, date.today())
    if target.out is None:
        return [*notes, "nothing was written: use --out calibration.toml to save the result"]
    file.save(calibration, target.out)
    old = getattr(instrument.calibration, name)
    replaced = f"; it replaces the {name} calibration of {old.date}" if old else ""
    return [*notes, *_signature_note(target.out), f"written to {target.out}{replaced}"]


def _signature_note(file: Path) -> list[str]:
    if read_signed(file, NO_TRUSTED_KEYS).signature.state is not SignatureState.ALTERED:
        return []
    return [
        f"the signature of {file} is no longer valid: sign the file again with pneuforce sign file {file}"
    ]


def _applied(
    configuration: Configuration, calibration: Calibration, part: CalibrationPart, target: CalibrationTarget
) -> ChainSettings:
    """Return the settings of the measuring chain with a calibration that contains the new part.

    Raises ConfigurationError, which names the file of a value that is wrong.
    """
    try:
        return apply_calibration(configuration.chain, calibration)
    except ConfigurationError as error:
        is_new = calibration.force is None or calibration.force is part
        name = part.source if is_new else target.out
        raise ConfigurationError(f"{name}: {error}; nothing was written") from None
