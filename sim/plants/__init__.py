"""Simulated balloons."""
