"""Instrument: computes the contact force and its uncertainty from the samples of the rig."""
