"""Contacts recorded with a reference force sensor, and their force by the uncalibrated force law."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.radius import suspected_pressure_unit
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.contact import ONSET_KPA
from pneuforce.instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA
from pneuforce.support.columns import Numbers, Points, parse_points, parse_table

PRESSURE_COLUMNS = ("baseline_kpa", "final_kpa")
#: Columns of the reference force and of its standard uncertainty. If a table has the first pair, force_n is
#: another force, for example that of the instrument.
FORCE_COLUMNS = (("reference_n", "reference_std_n"), ("force_n", "force_std_n"))
#: Column of the tables in which force_n is the force of the instrument: `export --contacts`,
#: `evaluate --contacts` and `estimate --csv`.
INSTRUMENT_COLUMN = "reason"
#: Optional column: reading of the reference sensor without contact [N] that its forces still contain.
ZERO_COLUMN = "force_zero_n"
#: Optional column: start of the recording in which the contact is, in seconds since 1970 (UTC).
RECORDING_COLUMN = "recording_utc_s"
#: Largest accepted reading of the reference sensor without contact [N].
MAX_ZERO_N = 0.02
MAX_FORCE_N = 20.0
#: Above this force, errors are relative to the force. Below this force, errors are in newtons.
RELATIVE_ERROR_MIN_N = 1.0


@dataclass(frozen=True, slots=True)
class CalibrationContacts:
    """Recorded contacts as columns of equal length, one element per contact."""

    baseline_kpa: Numbers
    rise_kpa: Numbers
    force_n: Numbers  #: force that the reference sensor measured
    std_n: Numbers  #: standard uncertainty of `force_n`
    law_n: Numbers  #: force that the uncalibrated force law gives
    small_strain_weight: Numbers  #: weight of the stretching energy, equation (4), in the force law

    def __len__(self) -> int:
        return len(self.force_n)

    def select(self, rows: Numbers) -> CalibrationContacts:
        """Return the contacts of the given rows. `rows` is a boolean mask or an array of indices."""
        return CalibrationContacts(*(getattr(self, field.name)[rows] for field in fields(self)))


def parse_contacts(content: bytes, name: str) -> Points:
    """Return the columns of a CSV text with contacts. Its reference force has the name force_n.

    Raises ConfigurationError if the text is invalid, or if its only force is that of the instrument.
    """
    names = parse_table(content, name).names
    columns = next((pair for pair in FORCE_COLUMNS if pair[0] in names), FORCE_COLUMNS[-1])
    if columns == FORCE_COLUMNS[-1] and INSTRUMENT_COLUMN in names:
        raise ConfigurationError(
            f"{name}: force_n is the force of the instrument, as the column {INSTRUMENT_COLUMN} shows, "
            "so the calibration would change nothing: add the force of a reference sensor as the column "
            "reference_n, or make the table with pneuforce calibrate contacts --from"
        )
    force, std = columns
    points = parse_points(content, name, [(*PRESSURE_COLUMNS, force)], [std, ZERO_COLUMN, RECORDING_COLUMN])
    renamed = dict(zip(columns, FORCE_COLUMNS[-1], strict=True))
    return replace(points, columns={renamed.get(key, key): points[key] for key in points.columns})


def read_contacts(points: Points, settings: ChainSettings) -> CalibrationContacts:
    """Return the contacts of a recording, with the force that the force law of these settings gives.

    Raises ConfigurationError, which names the line, if a row cannot be a contact.
    """
    _check(points)
    law_n = _law_n(points, settings)
    unsolved = np.isnan(law_n)
    if unsolved.any():
        raise points.error("the force law has no solution for these pressures", int(unsolved.argmax()))
    baseline = points["baseline_kpa"]
    weight = settings.law.small_strain_weight(baseline, settings.balloon)
    rise = points["final_kpa"] - baseline
    return CalibrationContacts(baseline, rise, points["force_n"], _std_n(points), law_n, weight)


def select_solved(points: Points, settings: ChainSettings) -> tuple[Points, list[int]]:
    """Return the contacts for which the force law has a solution, and the lines of the other contacts.

    Raises ConfigurationError, which names the line, if a row cannot be a contact.
    """
    _check(points)
    solved = np.isfinite(_law_n(points, settings))
    lines = np.array(points.lines)
    columns = {name: values[solved] for name, values in points.columns.items()}
    return replace(points, columns=columns, lines=lines[solved].tolist()), lines[~solved].tolist()


def _law_n(points: Points, settings: ChainSettings) -> Numbers:
    """Return the force of the law at each contact [N], NaN if the law has no solution."""
    law_n = settings.force_model.estimate(points["baseline_kpa"], points["final_kpa"]).force_n
    return np.where(np.isfinite(law_n) & (law_n > 0), law_n, np.nan)


def _std_n(points: Points) -> Numbers:
    return points.columns.get("force_std_n", np.zeros(len(points)))


def _check(points: Points) -> None:
    """Raise ConfigurationError, which names the line, if a row cannot be a contact."""
    baseline, force, std = points["baseline_kpa"], points["force_n"], _std_n(points)
    rise = points["final_kpa"] - baseline
    zero = points.columns.get(ZERO_COLUMN, np.zeros(len(points)))
    points.require_rows(1)
    _check_units(points)
    for invalid, why in (
        (
            (baseline < VALID_LOW_KPA) | (baseline > VALID_HIGH_KPA),
            f"baseline_kpa is outside {VALID_LOW_KPA:g} to {VALID_HIGH_KPA:g} kPa, so that the instrument "
            "shows no force",
        ),
        (rise < ONSET_KPA, f"final_kpa is not {ONSET_KPA:g} kPa above baseline_kpa, so there is no contact"),
        ((force <= 0) | (force > MAX_FORCE_N), f"force_n must be above 0 and at most {MAX_FORCE_N:g} N"),
        ((std < 0) | (std > force), "force_std_n must be from 0 to force_n"),
        (
            abs(zero) > MAX_ZERO_N,
            f"{ZERO_COLUMN}: the reference sensor did not read 0 without contact, so each of its forces is "
            "wrong: make the table again with --tare, or subtract this reading from the forces",
        ),
    ):
        if invalid.any():
            raise points.error(why, int(invalid.argmax()))


def _check_units(points: Points) -> None:
    unit = suspected_pressure_unit(points["final_kpa"])
    if unit:
        raise points.error(f"the pressures look like {unit}; they must be in kPa (gauge)")
    if np.median(points["force_n"]) > MAX_FORCE_N:
        raise points.error("the forces must be in N, not in mN or gf; 1 gf (weight of 1 g) is 0.00980665 N")
