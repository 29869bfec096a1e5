"""Status of the board at one instant: plain data that the limits evaluate."""

from __future__ import annotations

from dataclasses import dataclass, field

from pneuforce.protocol.frames import BoardState, Fault
from pneuforce.protocol.limits import HOST_SILENCE_S
from pneuforce.sim.board.filling import FillController
from pneuforce.sim.board.monitors import EmptyingMonitor, InletValveMonitor, TopUpMonitor, VentValveMonitor
from pneuforce.sim.board.proof_test import ProofTestPulses
from pneuforce.sim.board.reading import PressureReading
from pneuforce.sim.board.states import FILL, SAFE
from pneuforce.sim.board.supply import SupplyMonitor

#: Contact limit [kPa] and host timeout [s] until the first command of a host sets both.
CONTACT_LIMIT_AT_BOOT_KPA = 18.0
HOST_TIMEOUT_AT_BOOT_S = 2.0


@dataclass(slots=True)
class BoardStatus:
    """State of the board: pressure, valves, faults, monitors, and the values of the last command."""

    state: BoardState = BoardState.BOOT
    valves: int = SAFE
    setpoint_kpa: float = 0.0  #: setpoint in effect; 0 if no setpoint is in effect
    contact_limit_kpa: float = CONTACT_LIMIT_AT_BOOT_KPA
    host_timeout_s: float = HOST_TIMEOUT_AT_BOOT_S
    since_command_s: float = 0.0  #: time since the last command
    in_contact: bool = False
    reading: PressureReading = field(default_factory=PressureReading)
    supply: SupplyMonitor = field(default_factory=SupplyMonitor)
    inlet: InletValveMonitor = field(default_factory=InletValveMonitor)
    vent: VentValveMonitor = field(default_factory=VentValveMonitor)
    emptying: EmptyingMonitor = field(default_factory=EmptyingMonitor)
    filling: FillController = field(default_factory=FillController)
    top_ups: TopUpMonitor = field(default_factory=TopUpMonitor)
    proof_test: ProofTestPulses = field(default_factory=ProofTestPulses)
    latched_faults: list[Fault] = field(default_factory=list)  #: in the order in which they occurred

    @property
    def host_active(self) -> bool:
        """Return True if a command was received within the last 250 ms."""
        return self.since_command_s <= HOST_SILENCE_S

    @property
    def may_move_valves(self) -> bool:
        """Return True if the valves may be moved: the host is active, and the sensor is valid."""
        return self.host_active and self.reading.sensor_ok

    def update(self, adc_sum: int, supply_mv: int, dt_s: float) -> None:
        """Add one sample to the reading and to all monitors."""
        self.since_command_s += dt_s
        self.reading.step(adc_sum, dt_s)
        self.supply.step(supply_mv)
        self.inlet.step(self.valves == FILL, self.reading, dt_s)
        self.vent.step(self.valves == SAFE, self.reading, dt_s)
        venting, vent_open = self.state is BoardState.VENTING, self.valves == SAFE
        self.emptying.step(venting, vent_open, self.in_contact, self.reading, dt_s)
        observed = self.state is BoardState.HOLDING and self.may_move_valves and not self.in_contact
        self.top_ups.step(observed, self.reading, self.setpoint_kpa, dt_s)
