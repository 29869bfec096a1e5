"""The force model: pure physics, numbers in, numbers out. Pressures are gauge kPa, lengths mm, forces N.

kPa·mm² is mN, so a factor 1e-3 turns pressure times area into newtons. Equation numbers are those of
Gaudeni & Prattichizzo, "A Mathematical Model of the Pneumatic Force Sensor for Robot-assisted Surgery".
"""

from instrument.model.balloon import Balloon, Circuit
from instrument.model.correction import Correction
from instrument.model.force import Estimate, contact
from instrument.model.law import LIVE, PAPER, Law
from instrument.model.low_end import estimate
from instrument.model.methods import METHODS, Method

__all__ = [
    "LIVE",
    "METHODS",
    "PAPER",
    "Balloon",
    "Circuit",
    "Correction",
    "Estimate",
    "Law",
    "Method",
    "contact",
    "estimate",
]
