"""Vented, and verified so: both valves SAFE and the pressure below 0.3 kPa for 0.5 s of board time."""

from __future__ import annotations

from dataclasses import dataclass

from instrument.rig.frames import BoardState, Valve
from instrument.rig.limits import VENTED_KPA, VENTED_S
from instrument.rig.link import BRIDGED_S, RawSample


@dataclass(slots=True)
class VentedWatch:
    """Follows samples until the rig has proved that it is vented."""

    vented: bool = False
    _low_s: float = 0.0

    def step(self, raw: RawSample, pressure_kpa: float, zeroed: bool) -> None:
        """One sample later. Without a zero there is only the board's own word."""
        low = raw.message.valves == Valve.NONE and -VENTED_KPA <= pressure_kpa <= VENTED_KPA
        self._low_s = self._low_s + min(raw.elapsed_s, BRIDGED_S) if low else 0.0
        self.vented = self._low_s >= VENTED_S if zeroed else raw.message.state == BoardState.VENTED
