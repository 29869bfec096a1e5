"""The standard uncertainty of a force, propagated through the model by exact derivatives.

The root d of a balance g(d; p) = 0 moves with an input p by −(∂g/∂p)/(∂g/∂d). The derivatives by p come from
one evaluation with p + ih, h tiny (the complex step): exact to rounding, no difference quotient.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from instrument.model.balloon import LOWEST_RISE_KPA, Balloon, Circuit, Number
from instrument.model.force import Estimate, contact
from instrument.model.methods import METHODS
from instrument.model.pressed import Pressed

_STEP = 1e-30


@dataclass(frozen=True, slots=True, kw_only=True)
class InputErrors:
    """Standard uncertainties of what goes into the model.

    Noise: 0.7 counts rms (0.038 kPa) over 16 conversions and the filter. Gain: the part of the
    MPXV5050DP's error band that stays after the zero, ±1 % of the reading taken as rectangular. Radius:
    the residual of the quadratic of Fig. 4 and the caliper.
    """

    noise_kpa: float = 0.002
    gain: float = 0.01 / math.sqrt(3)
    radius_mm: float = 0.03


@dataclass(frozen=True, slots=True)
class Sensitivities:
    """Derivatives of the force by its inputs."""

    initial_n_per_kpa: float
    final_n_per_kpa: float
    radius_n_per_mm: float

    def std_n(self, initial_kpa: float, final_kpa: float, errors: InputErrors) -> float:
        """Standard uncertainty of the force [N]. The gain error is common to both pressures."""
        return math.hypot(
            self.initial_n_per_kpa * errors.noise_kpa,
            self.final_n_per_kpa * errors.noise_kpa,
            (self.initial_n_per_kpa * initial_kpa + self.final_n_per_kpa * final_kpa) * errors.gain,
            self.radius_n_per_mm * errors.radius_mm,
        )


def sensitivities(
    initial_kpa: float,
    final_kpa: float,
    indentation_mm: float,
    balloon: Balloon,
    circuit: Circuit,
    method: str = "energetic",
) -> Sensitivities:
    """Derivatives of the force at a solved contact, by ΔP_i, ΔP_f and R_i."""
    chosen = METHODS[method]
    small_strain = 1.0 if initial_kpa > balloon.switch_kpa else 0.0

    def balance_and_force(d: Number, dpi: Number, dpf: Number, dr: Number) -> tuple[Number, Number]:
        pressed = Pressed.between(initial_kpa + dpi, final_kpa + dpf, small_strain, balloon, circuit, dr)
        rf, gap = chosen.final_radius_mm(d, pressed), pressed.radius_mm - d
        return chosen.balance(d, pressed)[0], 1e-3 * math.pi * pressed.final_kpa * (rf * rf - gap * gap)

    ih = 1j * _STEP
    by_d, *by_inputs = (
        tuple(part.imag / _STEP for part in balance_and_force(*arguments))
        for arguments in (
            (indentation_mm + ih, 0.0, 0.0, 0.0),
            (indentation_mm, ih, 0.0, 0.0),
            (indentation_mm, 0.0, ih, 0.0),
            (indentation_mm, 0.0, 0.0, ih),
        )
    )
    return Sensitivities(*(force - by_d[1] * balance / by_d[0] for balance, force in by_inputs))


class LowEnd(NamedTuple):
    """The contact at a rise of 0.5 kPa, where the line to zero ends, and its sensitivities."""

    estimate: Estimate
    end: Sensitivities

    @classmethod
    def of(cls, initial_kpa: float, balloon: Balloon, circuit: Circuit, method: str = "energetic") -> LowEnd:
        """The low end at ΔP_i."""
        final_kpa = initial_kpa + LOWEST_RISE_KPA
        solved = contact(initial_kpa, final_kpa, balloon, circuit, method)
        d = solved.indentation_mm
        return cls(solved, sensitivities(initial_kpa, final_kpa, d, balloon, circuit, method))

    def at(self, rise_kpa: float) -> Sensitivities:
        """Sensitivities on the line F = F_low(ΔP_i) (ΔP_f − ΔP_i) / 0.5 kPa."""
        share, slope = rise_kpa / LOWEST_RISE_KPA, self.estimate.force_n / LOWEST_RISE_KPA
        by_both = share * (self.end.initial_n_per_kpa + self.end.final_n_per_kpa)
        return Sensitivities(by_both - slope, slope, share * self.end.radius_n_per_mm)
