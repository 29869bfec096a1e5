"""Ambient pressure P_0 that the force model uses: the configured value, or a recent measured value."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.model.uncertainty import InputUncertainties

#: A smaller change of the measured P_0 is ignored, so that noise does not change the force curve. It changes
#: the force by at most 0.02 %.
TOLERANCE_KPA = 0.05


@dataclass(slots=True)
class AmbientPressure:
    """Ambient pressure P_0 in use. It does not change during a contact.

    ΔP_i before the contact and ΔP_f in the contact are then converted with the same P_0.
    """

    measured_kpa: float = math.nan  #: measured P_0 in use; NaN while the configured P_0 is in use
    recent: bool = False  #: a measured P_0 is in use, and its source still works

    def follow(self, measured_kpa: float, *, in_contact: bool) -> None:
        """Use the most recent measured P_0 [kPa], NaN if none is recent. A contact keeps its P_0."""
        if not in_contact and not abs(measured_kpa - self.measured_kpa) <= TOLERANCE_KPA:
            self.measured_kpa = measured_kpa
        self.recent = math.isfinite(measured_kpa) and self.is_measured

    @property
    def is_measured(self) -> bool:
        """Return True if a measured P_0 is in use."""
        return math.isfinite(self.measured_kpa)

    def kpa(self, settings: ChainSettings) -> float:
        """Return P_0 in use [kPa]."""
        return self.measured_kpa if self.is_measured else settings.circuit.ambient_kpa

    def input_uncertainties(self, settings: ChainSettings) -> InputUncertainties:
        """Return the uncertainties of the inputs, with that of P_0 in use.

        A calibration with forces was made with the configured P_0, and has compensated its error. With a
        measured P_0, this error remains in the force.
        """
        inputs = settings.input_uncertainties
        if not self.is_measured:
            return inputs
        if settings.correction is not None or inputs.ambient_kpa == 0:
            return replace(inputs, ambient_kpa=InputUncertainties().ambient_kpa)
        std_kpa = settings.ambient_std_kpa if self.recent else inputs.ambient_kpa
        return replace(inputs, ambient_kpa=std_kpa)
