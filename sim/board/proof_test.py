"""Proof test: a short pulse of each valve, whose effect shows if the tube to the balloon is blocked.

The host requests the test and evaluates the pressures. The board only gives the two pulses, which change the
amount of gas by nearly opposite amounts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pneuforce.protocol.frames import SAMPLES_PER_S
from pneuforce.protocol.limits import FILL_KPA_PER_S, HALVING_FROM_KPA, VENT_KPA_PER_S
from pneuforce.sim.board.filling import BAND_KPA
from pneuforce.sim.board.reading import PressureReading
from pneuforce.sim.board.states import FILL, LOCKED, SAFE

#: Duration of the inlet pulse, which raises the pressure by about 0.08 kPa.
TEST_PULSE_S = 0.016
#: Duration of each half of the test: a pulse, and the time until balloon and sensor have the same pressure.
TEST_HALF_S = 0.36
#: Smallest rise of the pressure that shows that the inlet has opened [kPa].
MIN_TEST_RISE_KPA = 0.03
_PULSE_SAMPLES, _HALF_SAMPLES = round(TEST_PULSE_S * SAMPLES_PER_S), round(TEST_HALF_S * SAMPLES_PER_S)


@dataclass(slots=True)
class ProofTestPulses:
    """Sequence of the two valve pulses: first the inlet, then the vent."""

    _samples: int = 0  # samples since the start
    _start_kpa: float = 0.0
    _vent_samples: int = 0  # duration of the vent pulse

    def start(self, setpoint_kpa: float, reading: PressureReading) -> None:
        """Start the test.

        The vent pulse is as long as necessary to remove the gas of the inlet pulse. It is one sample longer
        if the pressure is above its band.
        """
        ratio = FILL_KPA_PER_S / (VENT_KPA_PER_S * math.sqrt(setpoint_kpa / HALVING_FROM_KPA))
        self._samples, self._start_kpa = 0, reading.filtered_kpa
        self._vent_samples = int(_PULSE_SAMPLES * ratio + 0.5) + (
            reading.filtered_kpa > setpoint_kpa + BAND_KPA
        )

    def step(self, reading: PressureReading) -> None:
        """Add one sample. Without a rise of the pressure, there is no vent pulse: no gas flowed in."""
        self._samples += 1
        if self._samples == _HALF_SAMPLES and not reading.filtered_kpa - self._start_kpa >= MIN_TEST_RISE_KPA:
            self._vent_samples = 0

    @property
    def finished(self) -> bool:
        """Return True if both halves are over."""
        return self._samples >= 2 * _HALF_SAMPLES

    def valves(self, may_open_inlet: bool) -> int:
        """Return the `Valve` mask of the valves to power. The vent pulse does not depend on the host."""
        if self._samples < _PULSE_SAMPLES:
            return FILL if may_open_inlet else LOCKED
        if 0 <= self._samples - _HALF_SAMPLES < self._vent_samples:
            return SAFE
        return LOCKED
