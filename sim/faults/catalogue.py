"""Catalogue of faults, ordered along the signal path from the gas supply to the host."""

from __future__ import annotations

from collections.abc import Mapping

from pneuforce.sim.faults.balloon import BALLOON
from pneuforce.sim.faults.board import BOARD
from pneuforce.sim.faults.gas import GAS
from pneuforce.sim.faults.kind import FaultKind
from pneuforce.sim.faults.line import LINE
from pneuforce.sim.faults.sensor import SENSOR

#: Faults by name.
CATALOGUE: Mapping[str, FaultKind] = {kind.name: kind for kind in (*GAS, *BALLOON, *SENSOR, *BOARD, *LINE)}
