"""The pressed balloons that are computed. This module needs no other library."""

from dataclasses import dataclass
from itertools import product

FORCES_N = (0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 3.25, 3.5)
FREE_PRESSURES_KPA = tuple(float(pressure_kpa) for pressure_kpa in range(13))
BASELINES_KPA = (5.5, 8.0, 11.0)
#: All combinations of law and baseline have the short list of friction coefficients.
LAWS = ("mooney-rivlin", "gent", "ogden")
FRICTIONS, MORE_FRICTIONS = (0.0, 0.2, 1.0), (0.05, 0.1, 0.5)


@dataclass(frozen=True)
class Case:
    """One pressed balloon. One-sided: a plate presses one half, and the other half is free."""

    law: str
    baseline_kpa: float
    sides: int
    friction: float
    gas_exponent: float = 1.0

    @property
    def name(self):
        """Name of the case in the table."""
        return f"{self.law}/{self.baseline_kpa:g}kPa/{self.sides}/{self.friction:g}/{self.gas_exponent:g}"


def cases(law):
    """Return all cases of a law."""
    found = [Case(law, *rest) for rest in product(BASELINES_KPA, (1, 2), FRICTIONS)]
    if law == LAWS[0]:
        found += [Case(law, 8.0, sides, friction) for sides, friction in product((1, 2), MORE_FRICTIONS)]
        found += [Case(law, 8.0, sides, 0.2, 1.1) for sides in (1, 2)]
    return found
