"""Forces of the instrument in the plateaus of a reference force: their error, and the coverage of ±2u."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import fmean
from typing import NamedTuple

from pneuforce.instrument.validation.reference_pairs import PLATEAU_S, PairedContact


class PlateauForce(NamedTuple):
    """Mean forces in one plateau. The force of the instrument is NaN if a sample of it has no force."""

    contact: int  #: number of the contact in the recording
    plateau_begin_s: float  #: time of the start of the plateau
    force_n: float
    force_std_n: float
    reference_n: float
    reference_std_n: float  #: scatter of the readings, and gain of the reference sensor

    @property
    def error_n(self) -> float:
        """Return the force of the instrument minus the reference [N]."""
        return self.force_n - self.reference_n

    @property
    def is_within(self) -> bool:
        """Return True if the reference is within ±2u. u contains the uncertainty of both forces."""
        return abs(self.error_n) <= 2 * math.hypot(self.force_std_n, self.reference_std_n)


class ReferenceErrors(NamedTuple):
    """Errors of the instrument in the plateaus in which it has a force. NaN if there is no such plateau."""

    with_force: int  #: number of plateaus in which the instrument has a force
    within_2u: int  #: number of them whose reference is within ±2u
    mean_error_n: float  #: mean of the force minus the reference
    rmse_n: float  #: root mean square of the force minus the reference


def reference_errors(plateaus: Sequence[PlateauForce]) -> ReferenceErrors:
    """Return the errors of the instrument in these plateaus."""
    errors_n = [plateau.error_n for plateau in plateaus if math.isfinite(plateau.error_n)]
    within = sum(plateau.is_within for plateau in plateaus)
    if not errors_n:
        return ReferenceErrors(0, within, math.nan, math.nan)
    rmse_n = math.sqrt(fmean(error_n**2 for error_n in errors_n))
    return ReferenceErrors(len(errors_n), within, fmean(errors_n), rmse_n)


class PlateauForces:
    """Means of the force of the instrument over the plateaus of a reference."""

    def __init__(self, plateaus: Sequence[PairedContact], reference_gain_std: float = 0.0) -> None:
        """Store the plateaus. `reference_gain_std` is the relative standard uncertainty of the gain."""
        self._plateaus = sorted(plateaus, key=lambda plateau: plateau.plateau_begin_s)
        self._gain_std = reference_gain_std
        self._sums = [(0, 0.0, 0.0)] * len(self._plateaus)  # number of samples, sum of forces, sum of u
        self._present = 0

    def add(self, t_s: float, force_n: float, std_n: float) -> None:
        """Add one sample of the instrument, in order of time since the beginning of the recording [s]."""
        while (
            self._present < len(self._plateaus)
            and t_s >= self._plateaus[self._present].plateau_begin_s + PLATEAU_S
        ):
            self._present += 1
        if self._present < len(self._plateaus) and t_s >= self._plateaus[self._present].plateau_begin_s:
            count, forces_n, stds_n = self._sums[self._present]
            self._sums[self._present] = count + 1, forces_n + force_n, stds_n + std_n

    def results(self) -> list[PlateauForce]:
        """Return the mean force in each plateau that has samples."""
        return [
            PlateauForce(
                plateau.contact,
                plateau.plateau_begin_s,
                forces_n / count,
                stds_n / count,
                plateau.force_n,
                math.hypot(plateau.force_std_n, self._gain_std * plateau.force_n),
            )
            for plateau, (count, forces_n, stds_n) in zip(self._plateaus, self._sums, strict=True)
            if count
        ]
