"""Conversion of fits to the parts of a calibration file."""

from __future__ import annotations

import math
from datetime import date
from typing import Any

from pneuforce.instrument.calibration.apply import force_conditions, grip_conditions
from pneuforce.instrument.calibration.contacts import RECORDING_COLUMN, CalibrationContacts
from pneuforce.instrument.calibration.file import validated
from pneuforce.instrument.calibration.force import CANDIDATES, ForceCalibration
from pneuforce.instrument.calibration.grip import GripFit
from pneuforce.instrument.calibration.lag import LagFit
from pneuforce.instrument.calibration.radius import RadiusFit
from pneuforce.instrument.calibration.residuals import (
    BinErrors,
    ForceResidual,
    force_residual,
    share_and_floor,
)
from pneuforce.instrument.calibration.sections import (
    Agreement,
    ForcePart,
    GripPart,
    LagPart,
    PressureBin,
    RadiusPart,
    VolumePart,
    rounded_outwards,
)
from pneuforce.instrument.calibration.volume import VolumeFit
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.pressure_bins import BIN_COUNT, pressure_bin_indices
from pneuforce.support.columns import Points

#: Unit that the file appends to the name of a coefficient.
_UNIT_SUFFIXES = {"by_initial": "_per_kpa", "by_both": "_per_kpa"}


def radius_part(fit: RadiusFit, points: Points, today: date) -> RadiusPart:
    """Return the radius part of the calibration file with the results of a radius fit.

    Raises ConfigurationError if a value is not plausible.
    """
    (rest, linear, square), (rest_std, linear_std, square_std) = (
        values.tolist() for values in (fit.quadratic.coefficients, fit.quadratic.stds)
    )
    values = {
        **_source(points, today),
        "rest_radius_mm": rest,
        "rest_radius_std_mm": rest_std,
        "radius_linear_mm_per_kpa": linear,
        "radius_linear_std_mm_per_kpa": linear_std,
        "radius_quadratic_mm_per_kpa2": square,
        "radius_quadratic_std_mm_per_kpa2": square_std,
        "correlation": fit.quadratic.correlation.clip(-1, 1).tolist(),
        "residual_mm": fit.quadratic.std,
        "low_kpa": float(points["pressure_kpa"].min()),
        "high_kpa": float(points["pressure_kpa"].max()),
        "shear_kpa_mm": fit.rubber.shear_kpa_mm,
        "limit_kpa": fit.rubber.limit_kpa,
        "limit_std_kpa": fit.rubber.limit_std_kpa,
        "rubber_residual_mm": fit.rubber.residual_mm,
        "skin_rest_radius_mm": fit.skin.rest_radius_mm,
        "skin_c1_kpa_mm": fit.skin.c1_kpa_mm,
        "skin_c2_kpa_mm": fit.skin.c2_kpa_mm,
        "skin_residual_mm": fit.skin_residual_mm,
    }
    return validated(RadiusPart, values, points.name)


def volume_part(fit: VolumeFit, points: Points, ambient_kpa: float, today: date) -> VolumePart:
    """Return the volume part of the calibration file with the results of a volume fit.

    Raises ConfigurationError if a value is not plausible.
    """
    values = {
        **_source(points, today),
        "volume_mm3": fit.volume_mm3,
        "volume_std_mm3": fit.std_mm3,
        "residual_kpa": fit.residual_kpa,
        "ambient_kpa": ambient_kpa,
    }
    return validated(VolumePart, values, points.name)


def lag_part(fit: LagFit, points: Points, today: date) -> LagPart:
    """Return the lag part of the calibration file with the results of a lag fit.

    Raises ConfigurationError if a value is not plausible.
    """
    values = {
        **_source(points, today),
        "tube_time_constant_s": fit.tube_time_constant_s,
        "tube_std_s": fit.std_s,
        "step_kpa": fit.step_kpa,
        "residual_kpa": fit.residual_kpa,
    }
    return validated(LagPart, values, points.name)


def grip_part(fit: GripFit, points: Points, settings: ChainSettings, today: date) -> GripPart:
    """Return the grip part of the calibration file. The grip was calibrated with `settings`.

    Raises ConfigurationError if a value is not plausible.
    """
    values = {
        **_source(points, today),
        "grip": fit.grip,
        "grip_std": fit.std,
        "made_for": grip_conditions(settings),
    }
    return validated(GripPart, values, points.name)


def force_part(
    calibration: ForceCalibration,
    by_pressure: list[BinErrors],
    points: Points,
    settings: ChainSettings,
    today: date,
) -> ForcePart:
    """Return the force part of the calibration file. The force calibration was made with `settings`.

    Raises ConfigurationError if a value is not plausible.
    """
    contacts, correction = calibration.contacts, calibration.correction
    held_out_n = calibration.chosen.held_out_n
    share, floor_n = share_and_floor(held_out_n, contacts)
    rise_low, rise_high = rounded_outwards(*correction.rise_span_kpa)
    low, high = rounded_outwards(*correction.baseline_span_kpa)
    coefficients: dict[str, Any] = {
        f"{term}{_UNIT_SUFFIXES.get(term, '')}": getattr(correction, term) for term in CANDIDATES[-1]
    }
    values = {
        **_source(points, today),
        **coefficients,
        "stds": calibration.fit.stds.tolist(),
        "correlation": calibration.fit.correlation.clip(-1, 1).tolist(),
        "rise_low_kpa": rise_low,
        "rise_high_kpa": rise_high,
        "rise_spans_kpa": _rise_spans_kpa(contacts),
        "recordings_utc_s": _recordings_utc_s(points),
        "initial_low_kpa": low,
        "initial_high_kpa": high,
        "residual_share": share,
        "residual_floor_n": floor_n,
        "made_for": force_conditions(settings),
        "before": _agreement(force_residual(contacts.law_n, contacts)),
        "after_unseen": _agreement(force_residual(held_out_n, contacts)),
        "bin": [PressureBin(**errors._asdict()) for errors in by_pressure],
    }
    return validated(ForcePart, values, points.name)


def _recordings_utc_s(points: Points) -> list[float] | None:
    """Return the start of each recording with contacts [s since 1970], None if it is not known."""
    starts_s = points.columns.get(RECORDING_COLUMN)
    return None if starts_s is None else sorted(set(starts_s.tolist()))


def _rise_spans_kpa(contacts: CalibrationContacts) -> list[list[float]]:
    """Return the smallest and the largest rise in each pressure bin; an empty list without contacts."""
    bins = pressure_bin_indices(contacts.baseline_kpa)
    rises = [contacts.rise_kpa[bins == index] for index in range(BIN_COUNT)]
    return [list(rounded_outwards(float(r.min()), float(r.max()))) if len(r) else [] for r in rises]


def _source(points: Points, today: date) -> dict[str, Any]:
    """Return the fields of `CalibrationPart`: the date, and the file that the part was computed from."""
    return {
        "date": today,
        "source": points.name,
        "source_sha256": points.sha256,
        "points": len(points),
    }


def _agreement(residual: ForceResidual) -> Agreement:
    return Agreement(
        mean_error_percent=_finite_or_none(residual.mean_error_percent),
        below_1_n_rmse_n=_finite_or_none(residual.rmse_n),
    )


def _finite_or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None
