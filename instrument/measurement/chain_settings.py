"""Parameters of the measuring chain, and the force model that follows from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from pneuforce.instrument.measurement.force_tables import force_table
from pneuforce.instrument.measurement.lag import SAMPLE_S
from pneuforce.instrument.model import LIVE_LAW, Balloon, Circuit, ForceCorrection, ForceLaw
from pneuforce.instrument.model.force_model import ForceModel
from pneuforce.instrument.model.method_uncertainty import without_force_reference
from pneuforce.instrument.model.published_model import PublishedModel
from pneuforce.instrument.model.uncertainty import InputUncertainties, ModelUncertainty


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainSettings:
    """Parameters of the measuring chain."""

    balloon: Balloon = field(default_factory=Balloon)
    circuit: Circuit = field(default_factory=Circuit)
    law: ForceLaw = LIVE_LAW
    correction: ForceCorrection | None = None
    input_uncertainties: InputUncertainties = field(default_factory=InputUncertainties)
    model_uncertainty: ModelUncertainty = field(
        default_factory=lambda: without_force_reference(LIVE_LAW, Balloon())
    )
    #: Time constant of the first-order low-pass filter of the displayed pressure.
    filter_time_constant_s: float = 0.06
    tube_time_constant_s: float = 0.06  #: first-order lag between balloon and sensor
    ambient_std_kpa: float = 0.1  #: standard uncertainty of a measured ambient pressure
    lag_relative_std: float = 0.15  #: relative standard uncertainty of `tube_time_constant_s`

    @classmethod
    def of(
        cls, law: ForceLaw, balloon: Balloon | None = None, circuit: Circuit | None = None
    ) -> ChainSettings:
        """Return the settings for a method without a force calibration, with its uncertainties."""
        balloon = balloon or Balloon()
        return cls(
            balloon=balloon,
            circuit=circuit or Circuit(),
            law=law,
            model_uncertainty=without_force_reference(law, balloon),
        )

    @property
    def filter_samples(self) -> int:
        """Return n of the filter: each sample changes the filtered pressure by 1/n of the difference."""
        return round(-1 / math.expm1(-SAMPLE_S / self.filter_time_constant_s))

    @property
    def force_model(self) -> ForceModel:
        """Return the force model.

        The method "membrane" needs a table. If it is not in the cache, the computation takes ten seconds.
        """
        if self.law.method != "membrane":
            return PublishedModel(self.balloon, self.circuit, self.law)
        from pneuforce.instrument.model.membrane.model import MembraneModel

        table = force_table(self.balloon, self.circuit, self.law.sides)
        return MembraneModel(self.balloon, self.circuit, replace(self.law, low="smooth"), table)
