"""The board in Python: the pressure state machine, its limits, and the bytes it speaks.

The firmware follows the same rules and is held to them by the same contract tests.
"""

from sim.board.board import Board

__all__ = ["Board"]
