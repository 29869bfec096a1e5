"""The catalogue of faults, in the order of the way from the supply to the host."""

from __future__ import annotations

from collections.abc import Mapping

from sim.faults.balloon import BALLOON
from sim.faults.board import BOARD
from sim.faults.gas import GAS
from sim.faults.kind import FaultKind
from sim.faults.line import LINE
from sim.faults.sensor import SENSOR

CATALOGUE: Mapping[str, FaultKind] = {kind.name: kind for kind in (*GAS, *BALLOON, *SENSOR, *BOARD, *LINE)}
