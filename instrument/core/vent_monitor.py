"""Verified vent: both valves without current and the pressure within ±0.3 kPa for 0.5 s of board time."""

from __future__ import annotations

from dataclasses import dataclass

from pneuforce.instrument.rig.link import MAX_SAMPLE_SPAN_S, RawSample
from pneuforce.protocol.frames import BoardState, Valve
from pneuforce.protocol.limits import VENTED_KPA, VENTED_S


@dataclass(slots=True)
class VentMonitor:
    """Monitor that checks in each sample whether the rig is vented."""

    vented: bool = False
    _low_s: float = 0.0

    def step(self, raw: RawSample, pressure_kpa: float, zeroed: bool) -> None:
        """Process one sample.

        If the sensor has no zero, the state that the board reports is used instead of the pressure.
        """
        low = raw.message.valves == Valve.NONE and -VENTED_KPA <= pressure_kpa <= VENTED_KPA
        self._low_s = self._low_s + min(raw.elapsed_s, MAX_SAMPLE_SPAN_S) if low else 0.0
        self.vented = self._low_s >= VENTED_S if zeroed else raw.message.state == BoardState.VENTED
