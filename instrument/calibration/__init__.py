"""Calibration of one balloon and its pneumatic circuit from recorded points."""
