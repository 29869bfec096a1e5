"""Membrane estimator: force of a thin rubber skin that is pressed flat, from its measured radius curve."""
