"""Contacts against a force cell: what was recorded, and what the law says of it."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from instrument.calibration.radius import unit_of_pressures
from instrument.chain import ChainSettings
from instrument.columns import Numbers, Points
from instrument.contact import ONSET_KPA
from instrument.model import estimate
from instrument.model.balloon import VALID_HIGH_KPA, VALID_LOW_KPA

COLUMNS = (("initial_kpa", "final_kpa", "force_n"),)
ALSO = ("force_std_n",)
MOST_FORCE_N = 20.0
#: Above this a force's error counts as a share of it, below it in newtons.
TURN_N = 1.0


@dataclass(frozen=True, slots=True)
class Contacts:
    """Columns of equal length."""

    initial_kpa: Numbers
    rise_kpa: Numbers
    force_n: Numbers  #: of the force cell
    std_n: Numbers  #: its standard uncertainty
    law_n: Numbers  #: the law's force, uncalibrated
    small_strain: Numbers  #: weight of stretching energy (4) in it

    def __len__(self) -> int:
        return len(self.force_n)

    def only(self, chosen: Numbers) -> Contacts:
        """The chosen rows, by a mask or by their numbers."""
        return Contacts(*(getattr(self, field.name)[chosen] for field in fields(self)))


def contacts_in(points: Points, own: ChainSettings) -> Contacts:
    """The contacts of a recording, and what the law of these settings says of them.

    Raises ConfigurationError with the line of one that is none.
    """
    initial, force = points["initial_kpa"], points["force_n"]
    rise = points["final_kpa"] - initial
    std = points.columns.get("force_std_n", np.zeros(len(points)))
    points.at_least(1)
    _check_units(points)
    for wrong, why in (
        (
            (initial < VALID_LOW_KPA) | (initial > VALID_HIGH_KPA),
            f"initial_kpa is outside {VALID_LOW_KPA:g} to {VALID_HIGH_KPA:g} kPa, where no force is shown",
        ),
        (rise < ONSET_KPA, f"final_kpa is not {ONSET_KPA:g} kPa above initial_kpa: this is no contact"),
        ((force <= 0) | (force > MOST_FORCE_N), f"force_n is not above 0 and up to {MOST_FORCE_N:g} N"),
        ((std < 0) | (std > force), "force_std_n is not from 0 to the force"),
    ):
        if wrong.any():
            raise points.refusal(why, int(wrong.argmax()))
    law_n = estimate(initial, points["final_kpa"], own.balloon, own.circuit, own.law).force_n
    unsolved = ~(np.isfinite(law_n) & (law_n > 0))
    if unsolved.any():
        raise points.refusal("the law has no force for these pressures", int(unsolved.argmax()))
    weight = own.law.small_strain(initial, own.balloon)
    return Contacts(initial, rise, force, std, law_n, weight)


def _check_units(points: Points) -> None:
    unit = unit_of_pressures(points["final_kpa"])
    if unit:
        raise points.refusal(f"the pressures look like {unit}; they must be in kPa (gauge)")
    if np.median(points["force_n"]) > 5 * MOST_FORCE_N:
        raise points.refusal("the forces look like mN; they must be in N")
