"""Firmware binary on an emulated ATmega328P, as a board of the simulator."""
