"""Faults of the simulated rig: a catalogue, put in at any time or on a schedule, and taken out again."""

from sim.faults.catalogue import CATALOGUE
from sim.faults.injection import Faults, Refused
from sim.faults.schedule import Planned, Schedule

__all__ = ["CATALOGUE", "Faults", "Planned", "Refused", "Schedule"]
