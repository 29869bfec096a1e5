"""Instrument on a simulated rig, for tests of programs. docs/integrators.md describes the pytest fixture."""

from pneuforce.errors import ConfigurationError, VentFailed
from pneuforce.registers.modbus.client import ModbusClientError, WriteRejectedError
from pneuforce.sim.faults import SimulatorRequestError
from pneuforce.sim.line.line_noise import LineNoise
from pneuforce.sim.line.proxy import SerialProxy, TcpProxy
from pneuforce.sim.server.client import SimulatorNotResponding
from pneuforce.teststand.child_process import ChildProcessFailed
from pneuforce.teststand.conditions import RigTripped, WaitTimeout
from pneuforce.teststand.rig import BalloonNotHeld, LiveRig
from pneuforce.teststand.running import simulated_rig

__all__ = [
    "BalloonNotHeld",
    "ChildProcessFailed",
    "ConfigurationError",
    "LineNoise",
    "LiveRig",
    "ModbusClientError",
    "RigTripped",
    "SerialProxy",
    "SimulatorNotResponding",
    "SimulatorRequestError",
    "TcpProxy",
    "VentFailed",
    "WaitTimeout",
    "WriteRejectedError",
    "simulated_rig",
]
