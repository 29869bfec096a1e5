"""Simulated pneumatic circuit: supply, valves, tubes, leaks, gas temperature and latex creep."""

from pneuforce.sim.pneumatics.circuit import Pneumatics
from pneuforce.sim.pneumatics.settings import PneumaticSettings

__all__ = ["PneumaticSettings", "Pneumatics"]
