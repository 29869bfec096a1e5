"""Force model: pure functions from pressures to force. Pressures are gauge kPa, lengths mm, forces N.

1 kPa·mm² is 1 mN, so a factor of 1e-3 turns pressure times area into newtons. Equation numbers refer to
Gaudeni & Prattichizzo, "A Mathematical Model of the Pneumatic Force Sensor for Robot-assisted Surgery"
("the paper").
"""

from pneuforce.instrument.model.balloon import Balloon, Circuit
from pneuforce.instrument.model.correction import ForceCorrection
from pneuforce.instrument.model.force import ContactEstimate, solve_contact
from pneuforce.instrument.model.law import LIVE_LAW, PAPER_LAW, ForceLaw
from pneuforce.instrument.model.low_rise import estimate
from pneuforce.instrument.model.methods import METHODS, ForceMethod

__all__ = [
    "LIVE_LAW",
    "METHODS",
    "PAPER_LAW",
    "Balloon",
    "Circuit",
    "ContactEstimate",
    "ForceCorrection",
    "ForceLaw",
    "ForceMethod",
    "estimate",
    "solve_contact",
]
