"""Checks of a rig before it is used: the port, the signal of the board, the pneumatic circuit."""
