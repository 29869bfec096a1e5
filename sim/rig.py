"""The whole rig in virtual time: plant, pneumatics, sensor, board and hand, one sample per step."""

from __future__ import annotations

from typing import NamedTuple

from instrument.rig.frames import SAMPLES_PER_S
from sim.board import Board
from sim.hand import Hand
from sim.plant import Gas, Plant, amount_kpa_mm3
from sim.pneumatics import Pneumatics, PneumaticSettings
from sim.sensor import Sensor, SensorSettings

STEP_US = 1_000_000 // SAMPLES_PER_S
STEP_S = STEP_US * 1e-6
SUPPLY_MV = 5000


class Truth(NamedTuple):
    """What the instrument can only estimate, at one sample."""

    sample: int  #: samples sent since boot; its low 16 bits are the frame's sequence
    t_s: float  #: time since the board booted
    force_n: float  #: that the balloon carries, along its axis
    applied_n: float  #: all of it, oblique parts included
    initial_kpa: float  #: pressure that the same gas would have without contact
    radius_mm: float  #: radius that the same gas would give without contact
    indentation_mm: float
    contact_radius_mm: float
    volume_mm3: float
    balloon_kpa: float


class Rig:
    """A rig that has just been switched on. The same seed and the same bytes give the same bytes."""

    def __init__(
        self,
        plant: Plant,
        hand: Hand,
        seed: int = 1,
        pneumatics: PneumaticSettings | None = None,
        sensor: SensorSettings | None = None,
    ) -> None:
        self.hand = hand
        self.board = Board()
        self._plant = plant
        self._pneumatics = Pneumatics(pneumatics or PneumaticSettings(), amount_kpa_mm3(plant, 0.0))
        self._sensor = Sensor(sensor or SensorSettings(), seed)
        self._steps = 0
        self._force_n = 0.0
        self._balloon = plant.settle(self._gas, 0.0)

    def step(self, received: bytes = b"") -> bytes:
        """What the board sends 2 ms later, having received these bytes."""
        self._steps += 1
        self._force_n = self.hand.step(self.board.holds, STEP_S).force_n(self._indentation_mm)
        self._balloon = self._plant.settle(self._gas, self._force_n)
        self._pneumatics.step(self._balloon.pressure_kpa, self.board.valves, STEP_S)
        adc_sum = self._sensor.adc_sum(self._pneumatics.sensor_kpa, STEP_S)
        return self.board.step(self._steps * STEP_US, adc_sum, SUPPLY_MV, received)

    @property
    def _gas(self) -> Gas:
        return Gas(self._pneumatics.gas_kpa_mm3)

    def _indentation_mm(self, force_n: float) -> float:
        return self._plant.settle(self._gas, force_n).indentation_mm

    @property
    def truth(self) -> Truth:
        """The truth behind the last sample."""
        balloon = self._balloon
        initial_kpa = self._plant.settle(self._gas, 0.0).pressure_kpa
        return Truth(
            self.board.samples,
            self._steps * STEP_S,
            self._force_n,
            self._force_n / self.hand.push.cosine,
            initial_kpa,
            self._plant.radius_mm(initial_kpa),
            balloon.indentation_mm,
            balloon.contact_radius_mm,
            balloon.volume_mm3,
            balloon.pressure_kpa,
        )
