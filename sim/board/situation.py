"""All that the board knows at one instant: plain data, which the limits judge."""

from __future__ import annotations

from dataclasses import dataclass, field

from instrument.rig.frames import BoardState, Fault
from instrument.rig.limits import HOST_SILENCE_S
from sim.board.filling import Filling
from sim.board.reading import Reading
from sim.board.states import FILL, SAFE
from sim.board.supply import Supply
from sim.board.watches import EmptyingWatch, InletWatch, TopUps, VentWatch

#: Until the host's first command.
CONTACT_LIMIT_AT_BOOT_KPA = 18.0
VENT_AFTER_AT_BOOT_S = 2.0


@dataclass(slots=True)
class Situation:
    """State, pressure, valves and what the host said last."""

    state: BoardState = BoardState.BOOT
    valves: int = SAFE
    setpoint_kpa: float = 0.0  #: in effect; 0 where there is none
    contact_limit_kpa: float = CONTACT_LIMIT_AT_BOOT_KPA
    vent_after_s: float = VENT_AFTER_AT_BOOT_S
    silent_s: float = 0.0  #: since the last command
    in_contact: bool = False
    reading: Reading = field(default_factory=Reading)
    supply: Supply = field(default_factory=Supply)
    inlet: InletWatch = field(default_factory=InletWatch)
    vent: VentWatch = field(default_factory=VentWatch)
    emptying: EmptyingWatch = field(default_factory=EmptyingWatch)
    filling: Filling = field(default_factory=Filling)
    top_ups: TopUps = field(default_factory=TopUps)
    latched: list[Fault] = field(default_factory=list)

    @property
    def heard(self) -> bool:
        """Whether the host has spoken lately."""
        return self.silent_s <= HOST_SILENCE_S

    @property
    def may_move(self) -> bool:
        """Whether a valve may be moved towards a setpoint: with a host and a sensor only."""
        return self.heard and self.reading.alive

    def observe(self, adc_sum: int, supply_mv: int, dt_s: float) -> None:
        """One sample later."""
        self.silent_s += dt_s
        self.reading.step(adc_sum, dt_s)
        self.supply.step(supply_mv)
        self.inlet.step(self.valves == FILL, self.reading, dt_s)
        self.vent.step(self.valves == SAFE, self.reading, dt_s)
        self.emptying.step(self.state is BoardState.VENTING, self.in_contact, self.reading, dt_s)
        free = self.state is BoardState.HOLDING and self.may_move and not self.in_contact
        self.top_ups.step(free, self.reading, self.setpoint_kpa, dt_s)
