"""The force model: pure physics, numbers in, numbers out. Pressures are gauge kPa, lengths mm, forces N.

kPa·mm² is mN, so a factor 1e-3 turns pressure times area into newtons. Equation numbers are those of
Gaudeni & Prattichizzo, "A Mathematical Model of the Pneumatic Force Sensor for Robot-assisted Surgery".
"""

from instrument.model.balloon import Balloon, Circuit
from instrument.model.force import Estimate, contact, estimate, on_the_line
from instrument.model.methods import METHODS, Method

__all__ = [
    "METHODS",
    "Balloon",
    "Circuit",
    "Estimate",
    "Method",
    "contact",
    "estimate",
    "on_the_line",
]
