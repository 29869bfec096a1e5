"""Python implementation of the board: pressure state machine, limits and rig link.

The firmware implements the same rules. The same contract tests run on this board and on the firmware.
"""

from pneuforce.sim.board.board import SimulatedBoard

__all__ = ["SimulatedBoard"]
