"""Faults of the simulated rig: catalogue, injection and removal at any time, and schedules."""

from pneuforce.sim.faults.catalogue import CATALOGUE
from pneuforce.sim.faults.injection import FaultInjector, SimulatorRequestError
from pneuforce.sim.faults.schedule import FaultSchedule, ScheduledFault

__all__ = ["CATALOGUE", "FaultInjector", "FaultSchedule", "ScheduledFault", "SimulatorRequestError"]
