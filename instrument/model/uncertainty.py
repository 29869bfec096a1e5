"""Standard uncertainty of a force: u² = u²(inputs) + u²(model).

u(inputs) is computed with exact derivatives of the force law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from pneuforce.instrument.model.derivatives import ContactDifferentiator
from pneuforce.instrument.model.pressure_bins import CoveredSpans, are_covered, pressure_bin_index

#: Standard deviation of a rectangular distribution of width 1 (GUM:1995, 4.3.7). ±2 of them contain all.
RECTANGULAR_STD = 1 / math.sqrt(12)
#: Time constant with which the walls warm or cool the gas. The slowest mode of heat conduction in a sphere
#: with the radius R has the time constant R²/(π²D). For air (D = 22 mm²/s) and R = 8.2 mm (8 kPa), it is
#: 0.31 s.
HEAT_EXCHANGE_S = 0.3
MIN_WARM_SHARE = 1e-3  #: a smaller share of the heat counts as none


@dataclass(frozen=True, slots=True, kw_only=True)
class InputUncertainties:
    """Standard uncertainties of the inputs of the force law."""

    #: Noise of ΔP_i. The noise of one conversion is 0.7 counts rms (0.038 kPa). A sample is the mean of 16
    #: conversions, and the samples are smoothed while the balloon has no contact.
    baseline_noise_kpa: float = 0.002
    #: Noise of ΔP_f at rest after lag compensation, for a tube with a lag of 60 ms.
    final_noise_kpa: float = 0.0104
    #: Relative error of the gain, common to both pressures. After zero adjustment, the error of the
    #: MPXV5050DP is at most ±1 % of the reading; a rectangular distribution is assumed.
    gain: float = 0.01 / math.sqrt(3)
    radius_mm: float = 0.03  #: radius R_i: residual of the quadratic of Fig. 4, and error of the caliper
    volume_mm3: float = 100.0  #: volume V_c of the tubes
    ambient_kpa: float = 1.0  #: ambient pressure P_0: changes due to the weather
    young_kpa: float = 100.0  #: Young's modulus E: differences between lots of natural latex
    rest_thickness_mm: float = 0.005  #: thickness h_0
    poisson: float = 0.005  #: Poisson's ratio ν
    #: Gas exponent n of a sudden contact: rms deviation from 1.0 if n is between 1.0 (isothermal) and 1.2
    #: (halfway to adiabatic). At rest, n is 1.0, because the walls have absorbed the heat.
    polytropic: float = 0.2 / math.sqrt(3)
    grip: float = RECTANGULAR_STD  #: grip, method "membrane": unknown between 0 and 1
    drift_kpa_per_s: float = 0.0005  #: drift of the baseline during a contact: creep and leak

    def at_rest(self, baseline_kpa: float, final_kpa: float, contact_s: float) -> MeasuredPressures:
        """Return two constant pressures and their uncertainties. `contact_s` is the age of the contact."""
        baseline_std_kpa = self.baseline_std_kpa(contact_s, 0.0)
        return MeasuredPressures(baseline_kpa, final_kpa, baseline_std_kpa, self.final_noise_kpa)

    def after_step(self, baseline_kpa: float, final_kpa: float, contact_s: float) -> MeasuredPressures:
        """Return two constant pressures and their uncertainties, `contact_s` after a sudden contact.

        Until about a second after a contact, the gas is warmer than the walls, which raises its pressure.
        """
        pressures = self.at_rest(baseline_kpa, final_kpa, contact_s)
        share = math.exp(-contact_s / HEAT_EXCHANGE_S)
        return pressures._replace(warm_share=share if share >= MIN_WARM_SHARE else 0.0)

    def baseline_std_kpa(self, contact_s: float, drifted_kpa: float) -> float:
        """Return the standard uncertainty of ΔP_i [kPa], `contact_s` after the start of the contact.

        `drifted_kpa` is the drift since the start, extrapolated from the drift before the contact.
        """
        return math.hypot(self.baseline_noise_kpa, drifted_kpa + self.drift_kpa_per_s * contact_s)


#: One value for each pressure bin, from the lowest ΔP_i to the highest.
BinValues = tuple[float, float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class BinUncertainty:
    """Standard uncertainty of the force law by pressure bin: a relative part and an absolute part."""

    relative_stds: BinValues
    absolute_stds_n: BinValues

    def relative_std(self, baseline_kpa: float) -> float:
        """Return the relative standard uncertainty at ΔP_i."""
        return self.relative_stds[pressure_bin_index(baseline_kpa)]

    def absolute_std_n(self, baseline_kpa: float) -> float:
        """Return the absolute standard uncertainty [N] at ΔP_i."""
        return self.absolute_stds_n[pressure_bin_index(baseline_kpa)]


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelUncertainty(BinUncertainty):
    """Standard uncertainty of the force law itself, which may be larger outside `covered` pressures."""

    #: Uncertainty outside the `covered` pressures. None: the values above apply to all pressures.
    outside: BinUncertainty | None = None
    covered: CoveredSpans = (None, None, None, None, None)

    @classmethod
    def constant(cls, relative_std: float, absolute_std_n: float = 0.0) -> ModelUncertainty:
        """Return an uncertainty that is the same at each ΔP_i."""
        relative = (relative_std, relative_std, relative_std, relative_std, relative_std)
        absolute_n = (absolute_std_n, absolute_std_n, absolute_std_n, absolute_std_n, absolute_std_n)
        return cls(relative_stds=relative, absolute_stds_n=absolute_n)

    def within(self, covered: CoveredSpans, before: BinUncertainty) -> ModelUncertainty:
        """Return this uncertainty for the covered pressures.

        At other pressures, it is the root of the sum of squares with the uncertainty `before`.
        """
        outside = BinUncertainty(
            relative_stds=_joined(self.relative_stds, before.relative_stds),
            absolute_stds_n=_joined(self.absolute_stds_n, before.absolute_stds_n),
        )
        return replace(self, outside=outside, covered=covered)

    def std_n(self, force_n: float, baseline_kpa: float, rise_kpa: float) -> float:
        """Return the standard uncertainty [N] of a force at ΔP_i and at a rise."""
        values: BinUncertainty = self
        if self.outside and not are_covered(self.covered, baseline_kpa, rise_kpa):
            values = self.outside
        return math.hypot(force_n * values.relative_std(baseline_kpa), values.absolute_std_n(baseline_kpa))


def _joined(own: BinValues, others: BinValues) -> BinValues:
    first, second, third, fourth, fifth = map(math.hypot, own, others)
    return first, second, third, fourth, fifth


class ForceSensitivity(NamedTuple):
    """Sensitivity of a force to its inputs at one point of a contact."""

    baseline_n_per_kpa: float
    final_n_per_kpa: float
    parameters_n: float  #: standard uncertainty due to all inputs except pressures, gain and n [N]
    heat_n: float  #: standard uncertainty due to the gas exponent n while the gas has all heat [N]


class MeasuredPressures(NamedTuple):
    """Two pressures, their standard uncertainties, and the heat of the gas."""

    baseline_kpa: float
    final_kpa: float
    baseline_std_kpa: float
    final_std_kpa: float
    warm_share: float = 0.0  #: share of the heat of the compression that is still in the gas


#: Uncertain parameters of the force law: fields of `Balloon`, and fields of `Circuit`.
BALLOON_PARAMETERS = ("young_kpa", "rest_thickness_mm", "poisson")
CIRCUIT_PARAMETERS = ("volume_mm3", "ambient_kpa", "polytropic")


def parameter_stds_n(
    differentiator: ContactDifferentiator, uncertainties: InputUncertainties
) -> dict[str, float]:
    """Return the standard uncertainty of the force [N] due to each parameter, at a solved contact."""
    derivatives = {"radius_mm": differentiator.by(radius_error_mm=1.0)}
    derivatives |= {name: differentiator.by_balloon(name) for name in BALLOON_PARAMETERS}
    derivatives |= {name: differentiator.by_circuit(name) for name in CIRCUIT_PARAMETERS}
    return {
        name: abs(derivative.force_n) * getattr(uncertainties, name)
        for name, derivative in derivatives.items()
    }


def force_std_n(
    force_n: float,
    sensitivity: ForceSensitivity,
    pressures: MeasuredPressures,
    input_uncertainties: InputUncertainties,
    model_uncertainty: ModelUncertainty,
) -> float:
    """Return the combined standard uncertainty of a force [N]."""
    return math.hypot(
        *contributions_n(force_n, sensitivity, pressures, input_uncertainties, model_uncertainty)
    )


def contributions_n(
    force_n: float,
    sensitivity: ForceSensitivity,
    pressures: MeasuredPressures,
    input_uncertainties: InputUncertainties,
    model_uncertainty: ModelUncertainty,
) -> tuple[float, ...]:
    """Return the contributions to the standard uncertainty of a force [N].

    The order is: ΔP_i, ΔP_f, gain of the sensor, parameters, gas exponent, force law. The first three
    contributions have the sign of their sensitivity.
    """
    by_baseline, by_final, parameters_n, heat_n = sensitivity
    return (
        by_baseline * pressures.baseline_std_kpa,
        by_final * pressures.final_std_kpa,
        (by_baseline * pressures.baseline_kpa + by_final * pressures.final_kpa) * input_uncertainties.gain,
        parameters_n,
        heat_n * pressures.warm_share,
        model_uncertainty.std_n(
            force_n, pressures.baseline_kpa, pressures.final_kpa - pressures.baseline_kpa
        ),
    )
