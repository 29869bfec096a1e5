"""Simulated rig in virtual time: balloon, pneumatics, sensor, board and hand, with one sample per step."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from pneuforce.protocol.frames import SAMPLES_PER_S
from pneuforce.sim.board import SimulatedBoard
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.plant import Plant, amount_kpa_mm3
from pneuforce.sim.pneumatics import Pneumatics, PneumaticSettings
from pneuforce.sim.sensor import Sensor, SensorSettings

STEP_US = 1_000_000 // SAMPLES_PER_S
STEP_S = STEP_US * 1e-6


class Truth(NamedTuple):
    """True state of the rig at one sample. The instrument can only estimate these values."""

    sample: int  #: number of samples sent since boot; the low 16 bits are the sequence number of the frame
    t_s: float  #: time since the board booted
    force_n: float  #: component of the force along the axis of the balloon
    applied_n: float  #: total force, including the component across the axis
    baseline_kpa: float  #: pressure that the same gas would have without contact
    radius_mm: float  #: radius that the balloon with the same gas would have without contact
    indentation_mm: float
    contact_radius_mm: float
    volume_mm3: float
    balloon_kpa: float  #: pressure in the balloon, relative to the pressure around it


class BoardProtocol(Protocol):
    """Interface of all boards: Python board, firmware compiled for this computer, and emulated firmware."""

    samples: int  #: number of samples sent since boot
    version: int  #: version of the rig link protocol

    @property
    def valves(self) -> int:
        """Return the `Valve` mask of the valves that the board powers now."""

    @property
    def is_holding(self) -> bool:
        """Return True if the balloon is locked at its setpoint."""

    def step(self, board_time_us: int, adc_sum: int, supply_mv: int, received: bytes) -> bytes:
        """Process received bytes and one sample. Return the bytes sent until `board_time_us` after boot."""


class Rig:
    """Simulated rig, switched on by its constructor.

    The same seed and the same received bytes give the same sent bytes. Faults write public attributes of the
    rig, of its pneumatics and of its sensor.
    """

    def __init__(
        self,
        plant: Plant,
        hand: Hand,
        seed: int = 1,
        pneumatics: PneumaticSettings | None = None,
        sensor: SensorSettings | None = None,
        new_board: Callable[[], BoardProtocol] = SimulatedBoard,
    ) -> None:
        self.hand = hand
        settings = pneumatics or PneumaticSettings()
        outside_kpa = settings.ambient_kpa + settings.reference_kpa
        gas_kpa_mm3 = amount_kpa_mm3(plant, 0.0, settings.tubes_mm3, outside_kpa)
        self.pneumatics = Pneumatics(settings, gas_kpa_mm3)
        self.sensor = Sensor(sensor or SensorSettings(), seed)
        self.supply_mv = 5000  #: mean supply voltage of sensor and ADC
        self.clock_rate = 1.0  #: frequency of the board's crystal relative to the nominal frequency
        self.frozen_board = False  #: if True, the clock of the board has stopped
        self._plant = plant
        self._new_board = new_board
        self._force_n = 0.0
        self._balloon = plant.settle(self.pneumatics.gas, 0.0)
        self.reset_board()

    def reset_board(self) -> None:
        """Boot the board. The valves return to the positions that they have without power."""
        self.board = self._new_board()
        self._steps = 0
        self._board_us = 0.0

    def step(self, received: bytes = b"") -> bytes:
        """Advance the time by 2 ms. Pass `received` to the board. Return the bytes that the board sends."""
        self._steps += 1
        settle, gas = self._plant.settle, self.pneumatics.gas
        push = self.hand.step(self.board.is_holding, STEP_S)
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
        """Return the true state at the last sample."""
        balloon = self._balloon
        growth = 1 + self.pneumatics.creep.growth
        baseline_kpa = self._plant.settle(self.pneumatics.gas, 0.0).pressure_kpa
        return Truth(
            self.board.samples,
            self._steps * STEP_S,
            self._force_n,
            self._force_n / self.hand.push.cosine,
            baseline_kpa,
            self._plant.radius_mm(baseline_kpa) * growth ** (1 / 3),
            balloon.indentation_mm,
            balloon.contact_radius_mm,
            balloon.volume_mm3 * growth,
            balloon.pressure_kpa,
        )
