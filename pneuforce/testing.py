"""Instrument on a simulated rig, for tests of programs. docs/integrators.md describes the pytest fixture."""

from pneuforce.errors import VentFailed
from pneuforce.registers.modbus.client import ModbusClientError, WriteRejectedError
from pneuforce.sim.faults import SimulatorRequestError
from pneuforce.sim.server.client import SimulatorNotResponding
from pneuforce.teststand.child_process import ChildProcessFailed
from pneuforce.teststand.rig import BalloonNotHeld, LiveRig, RigTripped, WaitTimeout
from pneuforce.teststand.running import simulated_rig

__all__ = [
    "BalloonNotHeld",
    "ChildProcessFailed",
    "LiveRig",
    "ModbusClientError",
    "RigTripped",
    "SimulatorNotResponding",
    "SimulatorRequestError",
    "VentFailed",
    "WaitTimeout",
    "WriteRejectedError",
    "simulated_rig",
]
