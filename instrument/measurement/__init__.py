"""Measuring chain from raw samples to measurements: zero, lag, baseline, contact, force."""
