"""The gas on its way: supply, valves, tubes and leaks, its warmth, and the latex that gives way to it."""

from sim.pneumatics.circuit import Pneumatics
from sim.pneumatics.settings import PneumaticSettings

__all__ = ["PneumaticSettings", "Pneumatics"]
