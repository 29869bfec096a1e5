"""Vented, and verified so: both valves SAFE and the pressure below 0.3 kPa for 0.5 s of board time."""

from __future__ import annotations

from dataclasses import dataclass

from instrument.rig.frames import BoardState, Sample, Valve

VENTED_KPA = 0.3
VENTED_S = 0.5
BRIDGED_S = 0.02  #: the most that one sample can vouch for: what went on in a longer gap is not known


@dataclass(slots=True)
class VentedWatch:
    """Follows samples until the rig has proved that it is vented."""

    vented: bool = False
    _low_s: float = 0.0
    _board_time_us: int = 0

    def step(self, sample: Sample, pressure_kpa: float, zeroed: bool) -> None:
        """One sample later. Without a zero there is only the board's own word."""
        dt_s = ((sample.board_time_us - self._board_time_us) & 0xFFFF_FFFF) * 1e-6
        self._board_time_us = sample.board_time_us
        low = sample.valves == Valve.NONE and -VENTED_KPA <= pressure_kpa <= VENTED_KPA
        self._low_s = self._low_s + min(dt_s, BRIDGED_S) if low else 0.0
        self.vented = self._low_s >= VENTED_S if zeroed else sample.state == BoardState.VENTED
