"""The binary that is flashed, run by an emulated ATmega328P as a board of the simulator."""
