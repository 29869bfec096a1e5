"""The whole rig in virtual time: plant, pneumatics, sensor, board and hand, one sample per step."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from instrument.rig.frames import SAMPLES_PER_S
from sim.board import Board
from sim.hand import Hand
from sim.plant import Plant, amount_kpa_mm3
from sim.pneumatics import Pneumatics, PneumaticSettings
from sim.sensor import Sensor, SensorSettings

STEP_US = 1_000_000 // SAMPLES_PER_S
STEP_S = STEP_US * 1e-6


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
    balloon_kpa: float  #: above the pressure around the balloon


class AnyBoard(Protocol):
    """What the rig asks of a board, be it Python, the firmware compiled for this machine, or emulated."""

    samples: int  #: sent since boot
    version: int  #: of the protocol that it speaks

    @property
    def valves(self) -> int:
        """`Valve` mask that the board drives now."""

    @property
    def holds(self) -> bool:
        """Whether the balloon is locked at its setpoint."""

    def step(self, board_time_us: int, adc_sum: int, supply_mv: int, received: bytes) -> bytes:
        """Bytes sent until `board_time_us` since boot, after bytes received and one sample taken."""


class Rig:
    """A rig that has just been switched on. The same seed and the same bytes give the same bytes.

    What a fault changes is a plain attribute of the rig, its pneumatics or its sensor.
    """

    def __init__(
        self,
        plant: Plant,
        hand: Hand,
        seed: int = 1,
        pneumatics: PneumaticSettings | None = None,
        sensor: SensorSettings | None = None,
        new_board: Callable[[], AnyBoard] = Board,
    ) -> None:
        self.hand = hand
        settings = pneumatics or PneumaticSettings()
        outside_kpa = settings.ambient_kpa + settings.reference_kpa
        gas_kpa_mm3 = amount_kpa_mm3(plant, 0.0, settings.tubes_mm3, outside_kpa)
        self.pneumatics = Pneumatics(settings, gas_kpa_mm3)
        self.sensor = Sensor(sensor or SensorSettings(), seed)
        self.supply_mv = 5000  #: of sensor and ADC
        self.clock_rate = 1.0  #: of the board's crystal, as a multiple of what it should be
        self.frozen_board = False  #: its clock stands
        self._plant = plant
        self._new_board = new_board
        self._force_n = 0.0
        self._balloon = plant.settle(self.pneumatics.gas, 0.0)
        self.reset_board()

    def reset_board(self) -> None:
        """The board boots; the valves fall back to where they are without current."""
        self.board = self._new_board()
        self._steps = 0
        self._board_us = 0.0

    def step(self, received: bytes = b"") -> bytes:
        """What the board sends 2 ms later, having received these bytes."""
        self._steps += 1
        settle, gas = self._plant.settle, self.pneumatics.gas
        push = self.hand.step(self.board.holds, STEP_S)
        self._force_n = push.force_n(lambda force_n: settle(gas, force_n).indentation_mm)
        self._balloon = settle(gas, self._force_n)
        self.pneumatics.step(self._balloon, self.board.valves, STEP_S)
        adc_sum = self.sensor.adc_sum(self.pneumatics.sensor_kpa, STEP_S)
        if not self.frozen_board:
            self._board_us += STEP_US * self.clock_rate
        supply_mv = self.supply_mv + self.sensor.ripple_mv(self._steps * STEP_S)
        return self.board.step(round(self._board_us), adc_sum, supply_mv, received)

    @property
    def truth(self) -> Truth:
        """The truth behind the last sample."""
        balloon = self._balloon
        growth = 1 + self.pneumatics.creep.growth
        initial_kpa = self._plant.settle(self.pneumatics.gas, 0.0).pressure_kpa
        return Truth(
            self.board.samples,
            self._steps * STEP_S,
            self._force_n,
            self._force_n / self.hand.push.cosine,
            initial_kpa,
            self._plant.radius_mm(initial_kpa) * growth ** (1 / 3),
            balloon.indentation_mm,
            balloon.contact_radius_mm,
            balloon.volume_mm3 * growth,
            balloon.pressure_kpa,
        )
