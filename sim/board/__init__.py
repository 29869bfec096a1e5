"""Python implementation of the board: pressure state machine, limits and rig link.

The firmware follows the same rules. The same contract tests run on both.
"""

from pneuforce.sim.board.board import SimulatedBoard

__all__ = ["SimulatedBoard"]
