"""Frames and limits that the board, the simulator and the host process share."""
