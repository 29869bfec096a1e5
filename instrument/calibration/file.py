"""The calibration file: what was measured of one balloon and its circuit, each part with date and origin."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from instrument import whole_file
from instrument.columns import MOST_ROWS
from instrument.errors import ConfigurationError
from instrument.model.law import Low, MethodName, Switch
from instrument.tables import Section, checked, tables_in, text_of, toml_text

DIGITS = 9
_END = re.compile(r"^\[end\]\s*^whole\s*=\s*(true|false)", re.MULTILINE)


def rounded(value: float) -> float:
    """A number as the file has it."""
    return float(f"{value:.{DIGITS}g}")


Rounded = AfterValidator(rounded)
Std = Annotated[float, Field(ge=0, le=1e6), Rounded]
Coefficient = Annotated[float, Field(ge=-20, le=20), Rounded]
Percent = Annotated[float, Field(ge=0, le=1e4), Rounded]
Share = Annotated[float, Field(ge=-1, le=1), Rounded]
#: Row by row; with the standard uncertainties it is the covariance, and has no unit.
Correlation = Annotated[list[list[Share]], Field(min_length=1, max_length=5)]
Date = Annotated[date, Field(ge=date(2000, 1, 1), le=date(2999, 12, 31))]


class Part(Section):
    """One part: when it was made, of which file."""

    date: Date
    source: str = Field(max_length=500)
    source_sha256: str = Field(pattern="^([0-9a-f]{64})?$")
    points: int = Field(ge=1, le=MOST_ROWS)


class RadiusPart(Part):
    """Radius of the free balloon: R_i = rest + linear ΔP + quadratic ΔP²."""

    rest_radius_mm: Annotated[float, Field(ge=1, le=30), Rounded]
    rest_radius_std_mm: Std
    radius_linear_mm_per_kpa: Annotated[float, Field(ge=-1, le=1), Rounded]
    radius_linear_std_mm_per_kpa: Std
    radius_quadratic_mm_per_kpa2: Annotated[float, Field(ge=-0.1, le=0.1), Rounded]
    radius_quadratic_std_mm_per_kpa2: Std
    correlation: Correlation
    residual_mm: Annotated[float, Field(ge=0, le=10), Rounded]
    low_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    high_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    shear_kpa_mm: Annotated[float, Field(ge=0, le=1e6), Rounded]  # μ h_0 of a neo-Hookean balloon
    limit_kpa: Annotated[float, Field(ge=0, le=1e4), Rounded]  # its highest pressure
    limit_std_kpa: Std
    rubber_residual_mm: Annotated[float, Field(ge=0, le=10), Rounded]


class VolumePart(Part):
    """Volume V_c of all pipes."""

    volume_mm3: Annotated[float, Field(ge=100, le=1e6), Rounded]
    volume_std_mm3: Std
    residual_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    ambient_kpa: Annotated[float, Field(ge=60, le=110), Rounded]


class LagPart(Part):
    """Lag of the tube between balloon and sensor."""

    tube_s: Annotated[float, Field(ge=0.001, le=0.5), Rounded]
    tube_std_s: Std
    step_kpa: Annotated[float, Field(ge=-50, le=50), Rounded]
    residual_kpa: Annotated[float, Field(ge=0, le=50), Rounded]


class MadeFor(Section):
    """The law that the force calibration corrects, and the balloon and the circuit that it had."""

    method: MethodName
    switch: Switch
    blend_kpa: Annotated[float, Field(ge=0, le=10), Rounded]  # to either side of the switch
    low: Low
    middle_kpa: Annotated[float, Field(ge=0, le=50), Rounded]  # ΔP_i at which p is 0
    young_kpa: Annotated[float, Field(ge=100, le=20_000), Rounded]
    poisson: Annotated[float, Field(ge=0.3, le=0.5), Rounded]
    rest_radius_mm: Annotated[float, Field(ge=1, le=30), Rounded]
    rest_thickness_mm: Annotated[float, Field(ge=0.01, le=1), Rounded]
    radius_linear_mm_per_kpa: Annotated[float, Field(ge=-1, le=1), Rounded]
    radius_quadratic_mm_per_kpa2: Annotated[float, Field(ge=-0.1, le=0.1), Rounded]
    volume_mm3: Annotated[float, Field(ge=100, le=1e6), Rounded]


class Agreement(Section):
    """Agreement with the force cell: mean error from 1 to 3.5 N, root mean square below 1 N."""

    mean_error_percent: Percent | None = None
    below_1_n_rmse_n: Annotated[float, Field(ge=0, le=100), Rounded] | None = None


class PressureBin(Section):
    """Mean error of forces from 1 to 3.5 N in a part of the pressures."""

    low_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    high_kpa: Annotated[float, Field(ge=0, le=50), Rounded]
    contacts: int = Field(ge=1, le=MOST_ROWS)
    before_percent: Percent
    after_percent: Percent


class ForcePart(Part):
    """Force = law · exp(constant + by_rise L + by_initial p + by_both L p + by_step w).

    L = ln(rise / 1 kPa), p = ΔP_i − middle_kpa (of `made_for`), w: weight of stretching energy (4) in the
    law. Coefficients that were not fitted are 0.
    """

    constant: Coefficient
    by_rise: Coefficient
    by_initial_per_kpa: Coefficient
    by_both_per_kpa: Coefficient
    by_step: Coefficient
    stds: Annotated[list[Std], Field(min_length=1, max_length=5)]  # of those that were fitted, in this order
    correlation: Correlation
    rise_low_kpa: Annotated[float, Field(ge=0.01, le=50), Rounded]
    rise_high_kpa: Annotated[float, Field(ge=0.01, le=50), Rounded]
    initial_low_kpa: Annotated[float, Field(ge=2, le=25), Rounded]
    initial_high_kpa: Annotated[float, Field(ge=2, le=25), Rounded]
    residual_share: Annotated[float, Field(ge=0, le=1), Rounded]  # standard deviation, of unseen contacts
    residual_floor_n: Annotated[float, Field(ge=0, le=20), Rounded]
    made_for: MadeFor
    before: Agreement
    after_unseen: Agreement  # each contact by a fit without it
    bin: list[PressureBin] = Field(max_length=10)

    @model_validator(mode="after")
    def _spans_are_spans(self) -> ForcePart:
        if not self.rise_low_kpa <= self.rise_high_kpa:
            raise ValueError("rise_low_kpa is above rise_high_kpa")
        if not self.initial_low_kpa <= self.initial_high_kpa:
            raise ValueError("initial_low_kpa is above initial_high_kpa")
        return self


class End(Section):
    """Nothing is missing: a file that was cut short has no end."""

    whole: Literal[True] = True


class Calibration(Section):
    """A whole calibration file."""

    version: int = Field(ge=1, le=1)
    balloon_id: int = Field(ge=0, le=0xFFFF_FFFF)
    radius: RadiusPart | None = None
    volume: VolumePart | None = None
    lag: LagPart | None = None
    force: ForcePart | None = None
    end: End

    @property
    def parts(self) -> list[Part]:
        """The parts that were made."""
        return [part for part in (self.radius, self.volume, self.lag, self.force) if part is not None]

    @property
    def date_code(self) -> int:
        """Date of the newest part, yyyymmdd; 0 without one."""
        return max((int(f"{part.date:%Y%m%d}") for part in self.parts), default=0)


def empty(balloon_id: int) -> Calibration:
    """A calibration of nothing."""
    return Calibration(version=1, balloon_id=balloon_id, end=End())


def load(path: Path) -> Calibration:
    """The calibration of a file. Raises ConfigurationError with file, key and allowed span."""
    text = text_of(path, f"pneuforce calibrate force contacts.csv --out {path} writes one")
    if not _END.search(text):
        raise ConfigurationError(f"{path}: cut short: its last lines, [end] and whole = true, are missing")
    return checked(Calibration, tables_in(text, str(path)), str(path))


def text(calibration: Calibration) -> str:
    """The file of a calibration."""
    title = "# Written by pneuforce calibrate. Names end in their units; std is a standard uncertainty.\n"
    return f"{title}{toml_text(calibration)}\n"


def save(calibration: Calibration, path: Path) -> None:
    """Write the file: the old one stays until the new one is whole. Raises ConfigurationError."""
    whole_file.write(path, [text(calibration)])
