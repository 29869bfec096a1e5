"""The standard uncertainty of a force: u² = inputs² + model², by exact derivatives of the law."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from instrument.model.balloon import Balloon
from instrument.model.derivatives import Derivatives
from instrument.model.law import MethodName


@dataclass(frozen=True, slots=True, kw_only=True)
class InputErrors:
    """Standard uncertainties of what goes into the model."""

    #: Of ΔP_i: 0.7 counts rms (0.038 kPa), 16 conversions averaged, and smoothed while the balloon is free.
    initial_noise_kpa: float = 0.002
    #: Of ΔP_f in the balloon now, its lag undone: what the Kalman filter of a tube of 60 ms lets through.
    final_noise_kpa: float = 0.026
    #: MPXV5050DP after its zero: ± 1 % of the reading, taken as rectangular, common to both pressures.
    gain: float = 0.01 / math.sqrt(3)
    radius_mm: float = 0.03  #: residual of the quadratic of Fig. 4, and the caliper
    volume_mm3: float = 100.0  #: V_c
    ambient_kpa: float = 1.0  #: P_0: the weather
    young_kpa: float = 100.0  #: E of natural latex from one lot to the next
    rest_thickness_mm: float = 0.005  #: h_0
    poisson: float = 0.005  #: ν
    #: n from 1.0 (isothermal) to 1.2 (half of adiabatic): root mean square distance from 1.0.
    polytropic: float = 0.2 / math.sqrt(3)
    drift_kpa_per_s: float = 0.0005  #: of the baseline while a contact hides it: creep and leak

    def at_rest(self, initial_kpa: float, final_kpa: float, contact_s: float) -> Pressures:
        """Two pressures that do not move, `contact_s` after the balloon was free."""
        initial_std_kpa = self.initial_std_kpa(contact_s, 0.0)
        return Pressures(initial_kpa, final_kpa, initial_std_kpa, self.final_noise_kpa)

    def initial_std_kpa(self, contact_s: float, drifted_kpa: float) -> float:
        """Of ΔP_i, `contact_s` after the balloon was free, had it gone on drifting as was seen before."""
        return math.hypot(self.initial_noise_kpa, drifted_kpa + self.drift_kpa_per_s * contact_s)


class Printed(NamedTuple):
    """Mean absolute errors of a method, as the paper prints them, as shares of the force."""

    below: float  #: up to `Balloon.switch_kpa`
    above: float


#: Energetic: 6.77 % above 8.85 kPa and 9.14 % over all 27 pressures, 11 of which lie above; so 10.8 % below.
#: The older two: what is printed for ΔV/V_i < 0.2 is taken for all that lies below.
PRINTED: Mapping[MethodName, Printed] = {
    "energetic": Printed(below=0.1077, above=0.0677),
    "lulevich": Printed(below=0.4388, above=0.1415),
    "shanahan": Printed(below=0.5227, above=0.1412),
}
#: The standard deviation of a normal error over its mean absolute value.
STD_OF_MEAN = math.sqrt(math.pi / 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelErrors:
    """What the law itself is wrong by, as standard deviations: a share of the force, and newtons."""

    share_below: float = PRINTED["energetic"].below * STD_OF_MEAN  #: up to `Balloon.switch_kpa`
    share_above: float = PRINTED["energetic"].above * STD_OF_MEAN
    floor_n: float = 0.0
    join: bool = True  #: whether line and smooth join below 0.5 kPa are equally likely

    @classmethod
    def of(cls, method: MethodName) -> ModelErrors:
        """Those of a method without a calibration."""
        printed = PRINTED[method]
        return cls(share_below=printed.below * STD_OF_MEAN, share_above=printed.above * STD_OF_MEAN)

    def share(self, initial_kpa: float, balloon: Balloon) -> float:
        """Share of the force at ΔP_i."""
        return self.share_above if initial_kpa > balloon.switch_kpa else self.share_below


class Spread(NamedTuple):
    """How a force reacts to its inputs, at one point of one contact."""

    initial_n_per_kpa: float
    final_n_per_kpa: float
    parameters_n: float  #: standard uncertainty by all that is neither pressure nor gain [N]
    join_n: float = 0.0  #: distance between line and smooth join [N]


class Pressures(NamedTuple):
    """Two pressures and how well they are known."""

    initial_kpa: float
    final_kpa: float
    initial_std_kpa: float
    final_std_kpa: float


#: Inputs that are fields of the balloon and of the circuit.
OF_BALLOON = ("young_kpa", "rest_thickness_mm", "poisson")
OF_CIRCUIT = ("volume_mm3", "ambient_kpa", "polytropic")


def parameter_spreads_n(derivatives: Derivatives, errors: InputErrors) -> dict[str, float]:
    """Standard uncertainty of the force [N] by each parameter, at a solved contact."""
    slopes = {"radius_mm": derivatives.by(radius_error_mm=1.0)}
    slopes |= {name: derivatives.by_balloon(name) for name in OF_BALLOON}
    slopes |= {name: derivatives.by_circuit(name) for name in OF_CIRCUIT}
    return {name: abs(slope.force_n) * getattr(errors, name) for name, slope in slopes.items()}


def std_n(
    force_n: float,
    spread: Spread,
    known: Pressures,
    errors: InputErrors,
    model: ModelErrors,
    balloon: Balloon,
) -> float:
    """Standard uncertainty of a force [N]."""
    return math.hypot(*contributions_n(force_n, spread, known, errors, model, balloon))


def contributions_n(
    force_n: float,
    spread: Spread,
    known: Pressures,
    errors: InputErrors,
    model: ModelErrors,
    balloon: Balloon,
) -> tuple[float, ...]:
    """Standard uncertainties [N] by ΔP_i, ΔP_f, the sensor's gain, parameters, the law, its join to zero."""
    by_initial, by_final, parameters_n, join_n = spread
    return (
        by_initial * known.initial_std_kpa,
        by_final * known.final_std_kpa,
        (by_initial * known.initial_kpa + by_final * known.final_kpa) * errors.gain,
        parameters_n,
        math.hypot(force_n * model.share(known.initial_kpa, balloon), model.floor_n),
        join_n / math.sqrt(3) if model.join else 0.0,
    )
