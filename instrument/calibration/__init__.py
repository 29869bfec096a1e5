"""Calibrations: from recorded points to the numbers of one balloon and its circuit."""
