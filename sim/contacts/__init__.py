"""Simulated contacts: trajectories of force or travel, tissue, and the kinds of contact of a scenario."""
