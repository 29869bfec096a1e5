"""Fits become parts of the calibration file."""

from __future__ import annotations

import math
from datetime import date
from typing import Any

from instrument.calibration.applied import made_for
from instrument.calibration.file import Agreement, ForcePart, LagPart, PressureBin, RadiusPart, VolumePart
from instrument.calibration.force import CANDIDATES, ForceCalibration
from instrument.calibration.lag import Lag
from instrument.calibration.radius import Radius
from instrument.calibration.residuals import Bin, Residual, residual_of, share_and_floor
from instrument.calibration.volume import Volume
from instrument.chain import ChainSettings
from instrument.columns import Points

#: What the file adds to the names of coefficients.
_UNITS = {"by_initial": "_per_kpa", "by_both": "_per_kpa"}


def radius_part(found: Radius, points: Points, today: date) -> RadiusPart:
    """The part of a radius."""
    (rest, linear, square), (rest_std, linear_std, square_std) = (
        values.tolist() for values in (found.quadratic.coefficients, found.quadratic.stds)
    )
    return RadiusPart(
        **_origin(points, today),
        rest_radius_mm=rest,
        rest_radius_std_mm=rest_std,
        radius_linear_mm_per_kpa=linear,
        radius_linear_std_mm_per_kpa=linear_std,
        radius_quadratic_mm_per_kpa2=square,
        radius_quadratic_std_mm_per_kpa2=square_std,
        correlation=found.quadratic.correlation.clip(-1, 1).tolist(),
        residual_mm=found.quadratic.std,
        low_kpa=float(points["pressure_kpa"].min()),
        high_kpa=float(points["pressure_kpa"].max()),
        shear_kpa_mm=found.rubber.shear_kpa_mm,
        limit_kpa=found.rubber.limit_kpa,
        limit_std_kpa=found.rubber.limit_std_kpa,
        rubber_residual_mm=found.rubber.residual_mm,
    )


def volume_part(found: Volume, points: Points, ambient_kpa: float, today: date) -> VolumePart:
    """The part of a volume."""
    return VolumePart(
        **_origin(points, today),
        volume_mm3=found.volume_mm3,
        volume_std_mm3=found.std_mm3,
        residual_kpa=found.residual_kpa,
        ambient_kpa=ambient_kpa,
    )


def lag_part(found: Lag, points: Points, today: date) -> LagPart:
    """The part of a lag."""
    return LagPart(
        **_origin(points, today),
        tube_s=found.tube_s,
        tube_std_s=found.std_s,
        step_kpa=found.step_kpa,
        residual_kpa=found.residual_kpa,
    )


def force_part(
    found: ForceCalibration, by_pressure: list[Bin], points: Points, own: ChainSettings, today: date
) -> ForcePart:
    """The part of a force calibration of these settings."""
    correction, unseen_n = found.correction, found.chosen.unseen_n
    share, floor_n = share_and_floor(unseen_n, found.contacts)
    (rise_low, rise_high), (low, high) = correction.rise_span_kpa, correction.initial_span_kpa
    coefficients: dict[str, Any] = {
        f"{term}{_UNITS.get(term, '')}": getattr(correction, term) for term in CANDIDATES[-1]
    }
    return ForcePart(
        **_origin(points, today),
        **coefficients,
        stds=found.fit.stds.tolist(),
        correlation=found.fit.correlation.clip(-1, 1).tolist(),
        rise_low_kpa=rise_low,
        rise_high_kpa=rise_high,
        initial_low_kpa=low,
        initial_high_kpa=high,
        residual_share=share,
        residual_floor_n=floor_n,
        made_for=made_for(own),
        before=_agreement(residual_of(found.contacts.law_n, found.contacts)),
        after_unseen=_agreement(residual_of(unseen_n, found.contacts)),
        bin=[PressureBin(**b._asdict()) for b in by_pressure],
    )


def _origin(points: Points, today: date) -> dict[str, Any]:
    return {
        "date": today,
        "source": points.name,
        "source_sha256": points.sha256,
        "points": len(points),
    }


def _agreement(of: Residual) -> Agreement:
    return Agreement(mean_error_percent=_known(of.mean_error_percent), below_1_n_rmse_n=_known(of.rmse_n))


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
