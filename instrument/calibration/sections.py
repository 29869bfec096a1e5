"""Sections of the calibration file: one section for each measured part, with the limits of each value."""

from __future__ import annotations

import math
from datetime import date
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Annotated

from pydantic import AfterValidator, Field, JsonValue, model_validator

from pneuforce.instrument.calibration.ranges import (
    GRIP_RANGE,
    LAG_RELATIVE_STD_RANGE,
    LAG_RESIDUAL_RANGE,
    MIN_RADIUS_SPAN_KPA,
    REST_RADIUS_RANGE_MM,
    SLOPE_RANGE_MM_PER_KPA,
    STD_AT_1_N_RANGE_N,
    STEP_RANGE_KPA,
    STRETCH_RANGE,
    VOLUME_RELATIVE_STD_RANGE,
    require_range,
)
from pneuforce.instrument.measurement.contact import ONSET_KPA
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.instrument.model.law import Low, MethodName, Switch
from pneuforce.instrument.model.pressure_bins import BIN_COUNT
from pneuforce.support.columns import MAX_ROWS
from pneuforce.support.toml_sections import Section

DIGITS = 9  #: significant digits of every number in the file


def rounded(value: float) -> float:
    """Return the number as the file stores it, with `DIGITS` significant digits."""
    return float(f"{value:.{DIGITS}g}")


def rounded_outwards(low: float, high: float) -> tuple[float, float]:
    """Return the span as the file stores it, not narrower than the given span."""
    down, up = Context(DIGITS, ROUND_FLOOR), Context(DIGITS, ROUND_CEILING)
    return float(down.create_decimal(repr(low))), float(up.create_decimal(repr(high)))


Rounded = AfterValidator(rounded)
Std = Annotated[float, Field(ge=0, le=1e6), Rounded]
Coefficient = Annotated[float, Field(ge=-20, le=20), Rounded]
Percent = Annotated[float, Field(ge=0, le=1e4), Rounded]
Share = Annotated[float, Field(ge=-1, le=1), Rounded]
#: Correlation matrix, row by row. Correlation and standard uncertainties together give the covariance.
Correlation = Annotated[list[list[Share]], Field(min_length=1, max_length=5)]
Rise = Annotated[float, Field(ge=ONSET_KPA, le=20), Rounded]
RiseSpan = Annotated[list[Rise], Field(max_length=2)]
FIRST_DATE, LAST_DATE = date(2020, 1, 1), date(2099, 12, 31)
ALLOWED_DATES: dict[str, JsonValue] = {"allowed_values": f"{FIRST_DATE} to {LAST_DATE}"}
Date = Annotated[date, Field(ge=FIRST_DATE, le=LAST_DATE, json_schema_extra=ALLOWED_DATES)]


class CalibrationPart(Section):
    """One part of a calibration: its date, and the file that the part was computed from."""

    date: Date
    source: str = Field(max_length=2000)
    source_sha256: str = Field(pattern="^([0-9a-f]{64})?$")
    points: int = Field(ge=1, le=MAX_ROWS)


class RadiusPart(CalibrationPart):
    """Radius of the free balloon: R_i = rest + linear ΔP + quadratic ΔP²."""

    rest_radius_mm: Annotated[float, Field(ge=REST_RADIUS_RANGE_MM[0], le=REST_RADIUS_RANGE_MM[1]), Rounded]
    rest_radius_std_mm: Annotated[float, Field(ge=0, le=0.2), Rounded]
    radius_linear_mm_per_kpa: Annotated[float, Field(ge=-1, le=1), Rounded]
    radius_linear_std_mm_per_kpa: Annotated[float, Field(ge=0, le=0.15), Rounded]
    radius_quadratic_mm_per_kpa2: Annotated[float, Field(ge=-0.1, le=0.1), Rounded]
    radius_quadratic_std_mm_per_kpa2: Annotated[float, Field(ge=0, le=0.015), Rounded]
    correlation: Correlation
    residual_mm: Annotated[float, Field(ge=0, le=0.3), Rounded]
    low_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    high_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    # μ h_0 of a neo-Hookean balloon: shear modulus times wall thickness at rest.
    shear_kpa_mm: Annotated[float, Field(ge=5, le=2000), Rounded]
    limit_kpa: Annotated[float, Field(ge=2, le=200), Rounded]  # limit pressure of a neo-Hookean balloon
    limit_std_kpa: Annotated[float, Field(ge=0, le=100), Rounded]
    rubber_residual_mm: Annotated[float, Field(ge=0, le=1), Rounded]
    # Mooney–Rivlin skin for the method "membrane": radius at rest, and constants that contain the thickness.
    # A file of an older release does not have them.
    skin_rest_radius_mm: Annotated[float, Field(ge=3, le=14), Rounded] | None = None
    skin_c1_kpa_mm: Annotated[float, Field(ge=0, le=2000), Rounded] | None = None
    skin_c2_kpa_mm: Annotated[float, Field(ge=0, le=2000), Rounded] | None = None
    skin_residual_mm: Annotated[float, Field(ge=0, le=0.5), Rounded] | None = None

    @model_validator(mode="after")
    def _check_plausibility(self) -> RadiusPart:
        rest, linear, quadratic = (
            self.rest_radius_mm,
            self.radius_linear_mm_per_kpa,
            self.radius_quadratic_mm_per_kpa2,
        )
        highest_mm = rest + (linear + quadratic * VALID_HIGH_KPA) * VALID_HIGH_KPA
        require_range("radius at 11.45 kPa / rest_radius_mm", highest_mm / rest, STRETCH_RANGE)
        for kpa in (VALID_LOW_KPA, VALID_HIGH_KPA):
            slope = linear + 2 * quadratic * kpa
            require_range(f"growth of the radius [mm/kPa] at {kpa:g} kPa", slope, SLOPE_RANGE_MM_PER_KPA)
        require_range("high_kpa - low_kpa", self.high_kpa - self.low_kpa, (MIN_RADIUS_SPAN_KPA, 50.0))
        return self


class VolumePart(CalibrationPart):
    """Volume V_c of all tubes."""

    # A tube with a length of 0.3 m and a bore of 1.5 mm has 530 mm³. With more than 60 000 mm³, the energetic
    # law has no solution at a rise of 6 kPa.
    volume_mm3: Annotated[float, Field(ge=500, le=60_000), Rounded]
    volume_std_mm3: Std
    residual_kpa: Annotated[float, Field(ge=0, le=10), Rounded]
    ambient_kpa: Annotated[float, Field(ge=60, le=110), Rounded]

    @model_validator(mode="after")
    def _check_plausibility(self) -> VolumePart:
        require_range(
            "volume_std_mm3 / volume_mm3", self.volume_std_mm3 / self.volume_mm3, VOLUME_RELATIVE_STD_RANGE
        )
        return self


class LagPart(CalibrationPart):
    """Lag of the tube between balloon and sensor."""

    tube_time_constant_s: Annotated[float, Field(ge=0.001, le=0.5), Rounded]
    tube_std_s: Std
    step_kpa: Annotated[float, Field(ge=-50, le=50), Rounded]
    residual_kpa: Annotated[float, Field(ge=0, le=10), Rounded]

    @model_validator(mode="after")
    def _check_plausibility(self) -> LagPart:
        relative_std = self.tube_std_s / self.tube_time_constant_s
        require_range("tube_std_s / tube_time_constant_s", relative_std, LAG_RELATIVE_STD_RANGE)
        require_range("the size of step_kpa", abs(self.step_kpa), STEP_RANGE_KPA)
        require_range("residual_kpa / step_kpa", self.residual_kpa / abs(self.step_kpa), LAG_RESIDUAL_RANGE)
        return self


class GripConditions(Section):
    """Balloon and circuit for which a grip is valid."""

    pressed_sides: Annotated[int, Field(ge=1, le=2)]
    rest_radius_mm: Annotated[float, Field(ge=1, le=30), Rounded]
    radius_linear_mm_per_kpa: Annotated[float, Field(ge=-1, le=1), Rounded]
    radius_quadratic_mm_per_kpa2: Annotated[float, Field(ge=-0.1, le=0.1), Rounded]
    volume_mm3: Annotated[float, Field(ge=100, le=1e6), Rounded]


class GripPart(CalibrationPart):
    """Grip of the contact, method membrane: 0 if the skin slides, 1 if it sticks."""

    grip: Annotated[float, Field(ge=GRIP_RANGE[0], le=GRIP_RANGE[1]), Rounded]
    grip_std: Annotated[float, Field(ge=0.01, le=0.5), Rounded]
    made_for: GripConditions


class ForceConditions(Section):
    """Force law, balloon and circuit for which the force calibration is valid."""

    method: MethodName
    switch: Switch
    # Half width of the pressure span in which the force law changes gradually (switch "blend").
    blend_kpa: Annotated[float, Field(ge=0, le=10), Rounded]
    low: Low
    middle_kpa: Annotated[float, Field(ge=0, le=50), Rounded]  # ΔP_i at which p of `ForcePart` is 0
    young_kpa: Annotated[float, Field(ge=100, le=20_000), Rounded]
    poisson: Annotated[float, Field(ge=0.3, le=0.5), Rounded]
    rest_radius_mm: Annotated[float, Field(ge=1, le=30), Rounded]
    rest_thickness_mm: Annotated[float, Field(ge=0.01, le=1), Rounded]
    radius_linear_mm_per_kpa: Annotated[float, Field(ge=-1, le=1), Rounded]
    radius_quadratic_mm_per_kpa2: Annotated[float, Field(ge=-0.1, le=0.1), Rounded]
    volume_mm3: Annotated[float, Field(ge=100, le=1e6), Rounded]
    # Method "membrane" only.
    grip: Annotated[float, Field(ge=GRIP_RANGE[0], le=GRIP_RANGE[1]), Rounded] | None = None
    pressed_sides: Annotated[int, Field(ge=1, le=2)] | None = None


class Agreement(Section):
    """Agreement with the reference sensor: mean error from 1 to 3.5 N, root mean square error below 1 N."""

    mean_error_percent: Percent | None = None
    below_1_n_rmse_n: Annotated[float, Field(ge=0, le=100), Rounded] | None = None


class PressureBin(Section):
    """Mean error of the forces from 1 to 3.5 N in one pressure bin, before and after the calibration."""

    low_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    high_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    contacts: int = Field(ge=1, le=MAX_ROWS)
    before_percent: Percent
    after_percent: Percent


UtcTime = Annotated[float, Field(ge=0, le=1e11)]


class ForcePart(CalibrationPart):
    """Force = law · exp(constant + by_rise L + by_initial p + by_both L p + by_step w).

    `law` is the force of the uncalibrated force law, L = ln(rise / 1 kPa), p = ΔP_i − `made_for.middle_kpa`,
    and w is the weight of the stretching energy, equation (4), in this law. Coefficients that were not fitted
    are 0.
    """

    constant: Coefficient
    by_rise: Coefficient
    by_initial_per_kpa: Coefficient
    by_both_per_kpa: Coefficient
    by_step: Coefficient
    # Standard uncertainties of the fitted coefficients, in the order of the fields above.
    stds: Annotated[list[Std], Field(min_length=1, max_length=5)]
    correlation: Correlation
    rise_low_kpa: Rise
    rise_high_kpa: Rise
    # Span of the rise of the contacts in each of the five pressure bins; empty for a bin without contacts. A
    # file of an older release does not have it.
    rise_spans_kpa: Annotated[list[RiseSpan], Field(min_length=BIN_COUNT, max_length=BIN_COUNT)] | None = None
    # Start of each recording from which the contacts are, in seconds since 1970 (UTC), if it is known.
    recordings_utc_s: Annotated[list[UtcTime], Field(max_length=1000)] | None = None
    initial_low_kpa: Annotated[float, Field(ge=VALID_LOW_KPA, le=VALID_HIGH_KPA), Rounded]
    initial_high_kpa: Annotated[float, Field(ge=VALID_LOW_KPA, le=VALID_HIGH_KPA), Rounded]
    # Standard deviation of the error on held-out contacts: a share of the force, and a floor in newtons. The
    # highest share is the uncertainty of the least accurate published method.
    residual_share: Annotated[float, Field(ge=0, le=0.66), Rounded]
    residual_floor_n: Annotated[float, Field(ge=0, le=1), Rounded]
    made_for: ForceConditions
    before: Agreement
    after_unseen: Agreement  # leave-one-out: a fit without the contact predicts its force
    bin: list[PressureBin] = Field(max_length=10)

    @model_validator(mode="after")
    def _check_plausibility(self) -> ForcePart:
        if not self.rise_low_kpa <= self.rise_high_kpa:
            raise ValueError("rise_low_kpa is above rise_high_kpa")
        for span in self.rise_spans_kpa or []:
            if span and not (
                len(span) == 2 and self.rise_low_kpa <= span[0] <= span[1] <= self.rise_high_kpa
            ):
                raise ValueError("rise_spans_kpa has a span that is not inside rise_low_kpa to rise_high_kpa")
        if not self.initial_low_kpa <= self.initial_high_kpa:
            raise ValueError("initial_low_kpa is above initial_high_kpa")
        std_n = math.hypot(self.residual_share, self.residual_floor_n)
        require_range("the standard deviation of a force of 1 N [N]", std_n, STD_AT_1_N_RANGE_N)
        return self
